// Finite differences, in double, of what samples along a ray weigh and show, and of a layer of a network.
#include <stdarg.h>
#include <setjmp.h>
#include <stdio.h>

#include <cmocka.h>

#include "in_double.h"
#include "kernels/volume.h"
#include "kernels/mlp.h"

#include "kernels/volume.c"
#include "kernels/mlp.c"

enum { N = 9, KEPT = 6, CHANNELS = 3, STRIDE = 8, ROWS = 8, COLUMNS = 8, SAMPLES = FS_MLP_PAD };

static void fill(double *x, int n, Rng *rng)
{
    for (int i = 0; i < n; i++) x[i] = fs_rng_normal(rng);
}

static void check(double *x, const double *gradient, int n, double (*loss)(void))
{
    for (int i = 0; i < n; i++) {
        const double at = x[i], h = 1e-5;
        x[i] = at + h;
        double up = loss();
        x[i] = at - h;
        double slope = (up - loss()) / (2 * h);
        x[i] = at;
        if (fabs(slope - gradient[i]) > 1e-6 * (1 + fabs(slope)))
            print_message("%d: differences %g, gradient %g\n", i, slope, gradient[i]);
        assert_true(fabs(slope - gradient[i]) <= 1e-6 * (1 + fabs(slope)));
    }
}

// ---- a ray ----

static double logarithm[N], tau[N], w[2][N], s[N], x[CHANNELS * STRIDE], want[CHANNELS];
static const int of[KEPT] = {0, 1, 3, 4, 6, 8};

static double loss_of_ray(void)
{
    double out[CHANNELS], sum = 0;
    fs_volume_scalar.thickness(logarithm, N, tau);
    sum += 0.7 * fs_volume_scalar.weights(tau, N, false, w[0]) + 0.4 * fs_volume_scalar.weights(tau, N, true, w[1]);
    VolumeBlend blend = {w[0], of, x, KEPT, CHANNELS, STRIDE};
    fs_volume_scalar.blend(&blend, out);
    for (int c = 0; c < CHANNELS; c++) sum += want[c] * out[c];
    for (int i = 0; i < N; i++) sum += w[1][i] * s[i];
    return sum + 0.9 * fs_volume_scalar.spread(w[0], s, N, 0.1);
}

static void test_ray(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(4);
    double d_x[CHANNELS * STRIDE] = {0}, d_w[2][N] = {{0}}, d_tau[N] = {0}, d_logarithm[N];
    fill(logarithm, N, &rng);
    fill(x, CHANNELS * STRIDE, &rng);
    fill(want, CHANNELS, &rng);
    for (int i = 0; i < N; i++) s[i] = (i + 0.3 * (double)fs_rng_uniform(&rng)) / N;
    loss_of_ray();
    VolumeBlend blend = {w[0], of, x, KEPT, CHANNELS, STRIDE};
    fs_volume_scalar.blend_backward(&blend, want, d_x, d_w[0]);
    fs_volume_scalar.spread_backward(w[0], s, N, 0.1, 0.9, d_w[0]);
    for (int i = 0; i < N; i++) d_w[1][i] = s[i];
    fs_volume_scalar.weights_backward(w[0], N, false, d_w[0], 0.7, d_tau);
    fs_volume_scalar.weights_backward(w[1], N, true, d_w[1], 0.4, d_tau);
    fs_volume_scalar.thickness_backward(logarithm, tau, d_tau, N, d_logarithm);
    check(logarithm, d_logarithm, N, loss_of_ray);
    for (int c = 0; c < CHANNELS; c++) check(x + c * STRIDE, d_x + c * STRIDE, KEPT, loss_of_ray);
}

// ---- two layers ----

static double weight[2][ROWS * COLUMNS], in[COLUMNS * SAMPLES], hidden[ROWS * SAMPLES], out[4 * SAMPLES],
    wanted[4 * SAMPLES];
static const MlpLayer first = {weight[0], ROWS, COLUMNS, SAMPLES}, second = {weight[1], 4, ROWS, SAMPLES};

static double loss_of_layers(void)
{
    double sum = 0;
    fs_mlp_scalar.forward(&first, true, in, hidden);
    fs_mlp_scalar.forward(&second, false, hidden, out);
    for (int i = 0; i < 4 * SAMPLES; i++) sum += wanted[i] * out[i];
    return sum;
}

static void test_layers(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(6);
    double d_hidden[ROWS * SAMPLES], d_in[COLUMNS * SAMPLES], d_weight[2][ROWS * COLUMNS] = {{0}};
    fill(weight[0], ROWS * COLUMNS, &rng);
    fill(weight[1], ROWS * COLUMNS, &rng);
    fill(in, COLUMNS * SAMPLES, &rng);
    fill(wanted, 4 * SAMPLES, &rng);
    loss_of_layers();
    fs_mlp_scalar.weights(&second, wanted, hidden, d_weight[1]);
    fs_mlp_scalar.back(&second, wanted, hidden, d_hidden);
    fs_mlp_scalar.weights(&first, d_hidden, in, d_weight[0]);
    check(weight[1], d_weight[1], 4 * ROWS, loss_of_layers);
    check(weight[0], d_weight[0], ROWS * COLUMNS, loss_of_layers);
    fs_mlp_scalar.back(&first, d_hidden, NULL, d_in);
    check(in, d_in, COLUMNS * SAMPLES, loss_of_layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ray), cmocka_unit_test(test_layers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// Finite differences, in double, of colour, gain and tint through the flash shading.
#include <stdarg.h>
#include <setjmp.h>
#include <stdio.h>

#include <cmocka.h>

#include "in_double.h"
#include "kernels/shade.h"

#include "kernels/shade.c"

enum { N = 11 };

static double means[N * 3], colors[N * 3], gains[N], out[N * 3], want[N * 3], d_colors[N * 3], d_gains[N], d_tint[3];
static const ShadeCloud cloud = {means, colors, gains};
static const ShadeGradients gradients = {d_colors, d_gains};
static ShadeLight light = {{0.3, -0.2, 0.1}, 2, {1.4, 1.1, 0.8}};

static double loss(void)
{
    double sum = 0;
    fs_shade_scalar.forward(&light, &cloud, 0, N, out);
    for (int i = 0; i < N * 3; i++) sum += want[i] * out[i];
    return sum;
}

static void check(double *value, const double *gradient, int n)
{
    for (int i = 0; i < n; i++) {
        const double step = 1e-5;
        double at = value[i];
        value[i] = at + step;
        double up = loss();
        value[i] = at - step;
        double down = loss();
        value[i] = at;
        double slope = (up - down) / (2 * step);
        if (fabs(slope - gradient[i]) > 1e-6 * fabs(gradient[i]) + 1e-9)
            print_message("%d: differences %g, gradient %g\n", i, slope, gradient[i]);
        assert_true(fabs(slope - gradient[i]) <= 1e-6 * fabs(gradient[i]) + 1e-9);
        assert_true(gradient[i] != 0);
    }
}

static void test_shade(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(31);
    for (int i = 0; i < N * 3; i++) {
        means[i] = 2 * fs_rng_normal(&rng);
        colors[i] = 0.1 + fs_rng_uniform(&rng);
        want[i] = fs_rng_normal(&rng);
    }
    for (int i = 0; i < N; i++) gains[i] = fs_rng_normal(&rng);
    for (int even = 0; even < 2; even++) {
        light.even = even;
        memset(d_tint, 0, sizeof d_tint);
        fs_shade_scalar.backward(&light, &cloud, 0, N, want, &gradients, d_tint);
        check(colors, d_colors, N * 3);
        check(gains, d_gains, N);
        check(light.tint, d_tint, 3);
    }
    for (int k = 0; k < 3; k++) means[k] += 1; // an even light does not ask where a Gaussian is
    double before = out[0];
    loss();
    assert_true(out[0] == before);
}

static double lit[N * 3];

static double loss_of_lit(void) // by T_F under the light and the gain
{
    static const unsigned char all[N] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    double sum = 0;
    memcpy(out, lit, sizeof out);
    fs_shade_scalar.leave(&light, &(ShadeCloud){means, out, gains}, all, 0, N);
    for (int i = 0; i < N * 3; i++) sum += want[i] * out[i] + want[(i + 1) % (N * 3)] * out[i] * gains[i / 3];
    return sum;
}

static void gradients_of_T_N(void)
{
    memset(d_gains, 0, sizeof d_gains);
    for (int i = 0; i < N * 3; i++) {
        d_colors[i] = want[i] + want[(i + 1) % (N * 3)] * gains[i / 3];
        d_gains[i / 3] += want[(i + 1) % (N * 3)] * colors[i];
    }
}

// A loss of (T_N, gain): its gradients as those of (T_F, gain); one Gaussian is not visible and stays.
static void test_lit_parameters(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(32);
    unsigned char visible[N];
    light.even = false;
    for (int i = 0; i < N; i++) gains[i] = fs_rng_normal(&rng), visible[i] = 1;
    for (int i = 0; i < N * 3; i++) {
        colors[i] = 0.1 + fs_rng_uniform(&rng);
        want[i] = fs_rng_normal(&rng);
    }
    gradients_of_T_N();
    memcpy(lit, colors, sizeof lit);
    visible[4] = 0;
    double d_color = d_colors[12], d_gain = d_gains[4];
    fs_shade_scalar.enter(&light, &(ShadeCloud){means, lit, gains}, visible, 0, N, &gradients);
    assert_true(lit[12] == colors[12] && d_colors[12] == d_color && d_gains[4] == d_gain);
    assert_true(lit[15] > colors[15]);
    visible[4] = 1;
    gradients_of_T_N();
    memcpy(lit, colors, sizeof lit);
    fs_shade_scalar.enter(&light, &(ShadeCloud){means, lit, gains}, visible, 0, N, &gradients);
    double *as_flash = out, largest = 0;
    fs_shade_scalar.forward(&light, &cloud, 0, N, as_flash);
    for (int i = 0; i < N * 3; i++) largest = fmax(largest, fabs(as_flash[i] - lit[i]));
    assert_true(largest < 1e-12);
    for (int set = 0; set < 2; set++) {
        double *value = set ? gains : lit, *gradient = set ? d_gains : d_colors;
        for (int i = 0; i < (set ? N : N * 3); i++) {
            const double step = 1e-5;
            double at = value[i];
            value[i] = at + step;
            double up = loss_of_lit();
            value[i] = at - step;
            double down = loss_of_lit();
            value[i] = at;
            assert_true(fabs((up - down) / (2 * step) - gradient[i]) <= 1e-6 * fabs(gradient[i]) + 1e-8);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shade), cmocka_unit_test(test_lit_parameters)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

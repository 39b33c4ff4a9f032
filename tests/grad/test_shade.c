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
static ShadeLight light = {{0.3, -0.2, 0.1}, 2, {1.4, 1.1, 0.8}};

static double loss(void)
{
    double sum = 0;
    fs_shade_scalar.forward(&light, means, colors, gains, 0, N, out);
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
        fs_shade_scalar.backward(&light, means, colors, gains, 0, N, want, d_colors, d_gains, d_tint);
        check(colors, d_colors, N * 3);
        check(gains, d_gains, N);
        check(light.tint, d_tint, 3);
    }
    for (int k = 0; k < 3; k++) means[k] += 1; // an even light does not ask where a Gaussian is
    double before = out[0];
    loss();
    assert_true(out[0] == before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shade)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

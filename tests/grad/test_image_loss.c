// Finite differences, in double, of every image-space loss term and of the chain compose -> loss terms, against the
// gradients of the scalar kernels.
#include <stdarg.h>
#include <setjmp.h>
#include <stdio.h>

#include <cmocka.h>

#include "in_double.h"
#include "kernels/photometric.h"
#include "kernels/smooth.h"

#include "kernels/compose.c"
// one static name each
#define loss photometric_loss
#include "kernels/photometric.c"
#undef loss
#define row pearson_row
#include "kernels/pearson.c"
#undef row
#define loss smooth_loss
#include "kernels/smooth.c"
#undef loss

enum { WIDTH = 19, HEIGHT = 14 };

// What the terms read and write; grad[i] belongs to value[i].
enum { T_N, T_F, R, BETA, DEPTH, VALUES };
typedef struct World {
    Planes value[VALUES], grad[VALUES];
    Planes Y, mu_Y, var_Y, mask;
    Planes I, T_linear, R_linear, I_linear, F_linear, d_I;
    PhotometricArgs photo;
    ComposeArgs compose;
    PearsonArgs pearson;
    SmoothArgs smooth;
    int rows; // of a strip
} World;

static Planes make_planes(int channels, double lo, double hi, Rng *rng)
{
    Planes p = {WIDTH, HEIGHT, channels, fs_planes_stride(WIDTH), NULL};
    size_t n = (size_t)p.stride * HEIGHT * (size_t)channels;
    p.px = malloc(n * sizeof(double));
    assert_non_null(p.px);
    for (size_t i = 0; i < n; i++)
        p.px[i] = (int)(i % (size_t)p.stride) < WIDTH ? lo + (hi - lo) * (double)fs_rng_uniform(rng) : 1e30;
    return p;
}

static World *make_world(bool with_mask, bool with_beta, double darkest)
{
    World *w = calloc(1, sizeof *w);
    assert_non_null(w);
    Rng rng = fs_rng_new(5);
    for (int i = 0; i < VALUES; i++) {
        int channels = i == BETA || i == DEPTH ? 1 : 3;
        w->value[i] = make_planes(channels, i == BETA ? 0.1 : darkest, i == DEPTH ? 3 : 1, &rng);
        w->grad[i] = make_planes(channels, 0, 0, &rng);
    }
    w->Y = make_planes(3, 0, 1, &rng);
    w->mask = make_planes(1, -0.5, 1.5, &rng);
    for (int i = 0; i < HEIGHT * w->mask.stride; i++) w->mask.px[i] = fmin(fmax(w->mask.px[i], 0), 1);
    Planes *more[] = {&w->mu_Y, &w->var_Y, &w->I, &w->T_linear, &w->R_linear, &w->I_linear, &w->F_linear, &w->d_I};
    for (size_t i = 0; i < sizeof more / sizeof *more; i++) *more[i] = make_planes(3, 0, 1, &rng);
    w->compose = (ComposeArgs){&w->value[T_N],
                               &w->value[R],
                               with_beta ? &w->value[BETA] : NULL,
                               &w->I,
                               &w->T_linear,
                               &w->R_linear,
                               &w->I_linear,
                               &w->d_I,
                               &w->grad[T_N],
                               &w->grad[R],
                               with_beta ? &w->grad[BETA] : NULL};
    w->photo =
        (PhotometricArgs){&w->I, &w->Y, &w->mu_Y, &w->var_Y, with_mask ? &w->mask : NULL, 0.2, 0.3, 0.7, &w->d_I, NULL};
    w->photo.scratch = malloc(2 * fs_photometric_scratch(WIDTH));
    assert_non_null(w->photo.scratch);
    w->pearson =
        (PearsonArgs){&w->value[T_N], &w->value[T_F], &w->T_linear, &w->F_linear, &w->grad[T_N], &w->grad[T_F], 0.3};
    w->rows = 4;
    return w;
}

static void free_world(World *w)
{
    for (int i = 0; i < VALUES; i++) free(w->value[i].px), free(w->grad[i].px);
    Planes *more[] = {&w->Y,        &w->mask,     &w->mu_Y,     &w->var_Y,    &w->I,
                      &w->T_linear, &w->R_linear, &w->I_linear, &w->F_linear, &w->d_I};
    for (size_t i = 0; i < sizeof more / sizeof *more; i++) free(more[i]->px);
    free(w->photo.scratch);
    free(w);
}

#define FOR_STRIPS(w, a, b)                                                                                            \
    for (int a = 0, b = (w)->rows; a < HEIGHT; a = b, b = b + (w)->rows < HEIGHT ? b + (w)->rows : HEIGHT)

// The terms: each returns its weighted value and, where `gradient`, adds to grad.
static double photo_term(World *w, bool gradient)
{
    double value = 0;
    w->photo.d_I = gradient ? &w->d_I : NULL;
    FOR_STRIPS(w, a, b) fs_compose_scalar.forward(&w->compose, a, b);
    FOR_STRIPS(w, a, b) fs_photometric_scalar.target_stats(&w->photo, a, b);
    FOR_STRIPS(w, a, b)
    {
        PhotometricSums s = fs_photometric_scalar.loss(&w->photo, a, b);
        double lambda = w->photo.lambda, kappa = w->photo.kappa;
        value += w->photo.weight * ((1 - lambda - kappa) * s.l1 + lambda * s.dssim + kappa * s.contrast);
    }
    if (gradient) FOR_STRIPS(w, a, b) fs_compose_scalar.backward(&w->compose, a, b);
    return value;
}

static double pearson_term(World *w, bool gradient)
{
    PearsonSums t = {0};
    fs_compose_scalar.decode(&w->value[T_N], &w->T_linear, 0, HEIGHT);
    fs_compose_scalar.decode(&w->value[T_F], &w->F_linear, 0, HEIGHT);
    FOR_STRIPS(w, a, b)
    {
        PearsonSums s = fs_pearson_scalar.sums(&w->pearson, a, b);
        t.n += s.n, t.x += s.x, t.y += s.y, t.xx += s.xx, t.yy += s.yy, t.xy += s.xy;
    }
    if (gradient) FOR_STRIPS(w, a, b) fs_pearson_scalar.gradient(&w->pearson, &t, a, b);
    return w->pearson.weight * fs_pearson_fit(&t).loss;
}

static double smooth_of(World *w, int i, double g, bool gradient)
{
    double value = 0;
    w->smooth = (SmoothArgs){&w->value[i], g, 0.9, gradient ? &w->grad[i] : NULL};
    FOR_STRIPS(w, a, b) value += w->smooth.weight * fs_smooth_scalar.loss(&w->smooth, a, b);
    return value;
}
static double guided_of(World *w, bool gradient)
{
    double value = 0;
    w->smooth = (SmoothArgs){&w->value[DEPTH], 0.5, 0.7, gradient ? &w->grad[DEPTH] : NULL, &w->Y};
    FOR_STRIPS(w, a, b) value += w->smooth.weight * fs_smooth_scalar.guided(&w->smooth, a, b);
    return value;
}
static double smooth_term(World *w, bool gradient)
{
    return guided_of(w, gradient) + smooth_of(w, DEPTH, 0.8, gradient) + smooth_of(w, BETA, 100, gradient);
}
static double all_terms(World *w, bool gradient)
{
    return photo_term(w, gradient) + pearson_term(w, gradient) + smooth_term(w, gradient);
}

typedef double Term(World *w, bool gradient);

// A quarter of the values of plane i, more of them at the borders, against central differences: 1e-5 of the gradient's
// size there.
static void check_plane(World *w, Term *term, int i, const char *name)
{
    Planes *p = &w->value[i];
    double largest = 0, worst = 0;
    for (int c = 0; c < p->channels; c++)
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) largest = fmax(largest, fabs(fs_planes_row(&w->grad[i], c, y)[x]));
    assert_true(largest > 0);
    for (int c = 0; c < p->channels; c++)
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                bool border = x == 0 || y == 0 || x == WIDTH - 1 || y == HEIGHT - 1;
                if ((x + 2 * y + c) % (border ? 3 : 5)) continue;
                double *v = fs_planes_row(p, c, y) + x, at = *v, g = fs_planes_row(&w->grad[i], c, y)[x];
                const double step = 1e-6;
                *v = at + step;
                double up = term(w, false);
                *v = at - step;
                double down = term(w, false);
                *v = at;
                double error = fabs((up - down) / (2 * step) - g) / (fabs(g) + 1e-2 * largest);
                if (error > 1e-5)
                    print_message("%s %d,%d,%d: differences %g, gradient %g\n", name, c, y, x, (up - down) / (2 * step),
                                  g);
                worst = fmax(worst, error);
            }
    assert_true(worst < 1e-5);
}

static void check_term(Term *term, bool mask, bool beta, double darkest, const int *planes, int n)
{
    static const char *const names[VALUES] = {"T_N", "T_F", "R", "beta", "depth"};
    World *w = make_world(mask, beta, darkest);
    term(w, true);
    for (int i = 0; i < n; i++) check_plane(w, term, planes[i], names[planes[i]]);
    free_world(w);
}

static void test_photo(void **state)
{
    (void)state;
    check_term(photo_term, false, true, 0.1, (const int[]){T_N, R, BETA}, 3);
    check_term(photo_term, true, true, 0.1, (const int[]){T_N, R, BETA}, 3);
    check_term(photo_term, true, false, 0.1, (const int[]){T_N, R}, 2);
}
static void test_dark(void **state) // around and below the straight part of the tone curve
{
    (void)state;
    check_term(photo_term, true, true, 0, (const int[]){T_N, R, BETA}, 3);
}
static void test_pearson(void **state)
{
    (void)state;
    check_term(pearson_term, false, true, 0, (const int[]){T_N, T_F}, 2);
}
static void test_smooth(void **state)
{
    (void)state;
    check_term(smooth_term, false, true, 0, (const int[]){DEPTH, BETA}, 2);
}
static void test_all(void **state)
{
    (void)state;
    check_term(all_terms, true, true, 0.05, (const int[]){T_N, T_F, R, BETA, DEPTH}, 5);
}

// A black T under a black R still has a gradient towards the light.
static void test_black(void **state)
{
    (void)state;
    World *w = make_world(false, true, 0.1);
    w->photo.lambda = 0, w->photo.kappa = 0.1; // as trained
    for (int i = 0; i < 3 * HEIGHT * w->Y.stride; i++) w->value[T_N].px[i] = 0;
    photo_term(w, true);
    for (int x = 0; x < WIDTH; x++) {
        double g = fs_planes_row(&w->grad[T_N], 0, 3)[x];
        assert_true(isfinite(g) && g != 0);
    }
    for (int i = 0; i < 3 * HEIGHT * w->Y.stride; i++) w->value[R].px[i] = w->grad[T_N].px[i] = 0;
    photo_term(w, true);
    for (int x = 0; x < WIDTH; x++) {
        double g = fs_planes_row(&w->grad[T_N], 0, 3)[x];
        assert_true(isfinite(g) && g < 0);
    }
    free_world(w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_photo),  cmocka_unit_test(test_dark), cmocka_unit_test(test_pearson),
        cmocka_unit_test(test_smooth), cmocka_unit_test(test_all),  cmocka_unit_test(test_black),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

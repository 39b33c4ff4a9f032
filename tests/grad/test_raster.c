// Finite differences, in double, of every parameter of a Gaussian through projection and rasterisation, with depth as
// a feature and the light that passes as a result. The cut-offs (alpha under 1/255, exhausted transmittance) are
// opened wide: they are steps, which no difference can cross.
#include <stdarg.h>
#include <setjmp.h>
#include <stdio.h>

#include <cmocka.h>

#include "in_double.h"
#include "kernels/projection.h"
#include "kernels/raster.h"
// one static name each
#define forward raster_forward
#define backward raster_backward
#include "kernels/raster.c"
#undef forward
#undef backward
#include "kernels/projection.c"

enum { N = 7, TILES_X = 4, TILES = 4, FEATURES = 4 };
#define OPEN_T_MIN (-60.0)

typedef struct World {
    double means[N * 3], scales[N * 3], quats[N * 4], opacities[N], colors[N * 3];
    double d_means[N * 3], d_scales[N * 3], d_quats[N * 4], d_opacities[N], d_colors[N * 3], d_depth[N];
    double want[TILES][FEATURES * FS_TILE_PIXELS], want_t[TILES][FS_TILE_PIXELS]; // dL/d result
    ProjectCamera camera;
    Splat splats[N];
    TileEntry entry[N];
    double moments[N * FS_RECORD];
} World;

static World *make_world(void)
{
    World *w = calloc(1, sizeof *w);
    assert_non_null(w);
    Rng rng = fs_rng_new(21);
    for (int i = 0; i < N; i++) {
        w->means[3 * i] = 0.5 * fs_rng_normal(&rng);
        w->means[3 * i + 1] = 0.5 * fs_rng_normal(&rng);
        w->means[3 * i + 2] = 2 + 0.3 * i; // in depth order
        for (int k = 0; k < 3; k++) w->scales[3 * i + k] = -1.5 + 0.5 * fs_rng_normal(&rng);
        for (int k = 0; k < 4; k++) w->quats[4 * i + k] = fs_rng_normal(&rng);
        w->opacities[i] = fs_rng_normal(&rng);
        for (int k = 0; k < 3; k++) w->colors[3 * i + k] = fs_rng_uniform(&rng);
    }
    w->means[0] = 1.9; // beyond the clamp of J: its tail still reaches the picture
    for (int t = 0; t < TILES; t++) {
        for (int i = 0; i < FEATURES * FS_TILE_PIXELS; i++) w->want[t][i] = fs_rng_normal(&rng);
        for (int i = 0; i < FS_TILE_PIXELS; i++) w->want_t[t][i] = fs_rng_normal(&rng);
    }
    const double s = sin(0.1), c = cos(0.1);
    w->camera = (ProjectCamera){
        {c, 0, s, 0, 1, 0, -s, 0, c}, {0.05, -0.1, 0.2}, 30, 31, 16, 15, 0.1, 32, 32, 0.65, 0.65, 0.3, 0.1};
    return w;
}

static RasterTile tile_of(World *w, int t)
{
    return (RasterTile){
        t % TILES_X * FS_TILE_W, t / TILES_X * FS_TILE_H, N, w->entry, w->splats, FEATURES, OPEN_T_MIN, 0};
}

// The loss: sum of all results, weighted at random.
static double render(World *w, double feature[][FEATURES * FS_TILE_PIXELS], double transmittance[][FS_TILE_PIXELS])
{
    ProjectParams params = {w->means, w->scales, w->quats, w->opacities};
    fs_project_scalar.forward(&w->camera, &params, 0, N, OPEN_T_MIN, w->splats);
    double loss = 0;
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) w->splats[i].feature[k] = w->colors[3 * i + k];
        w->splats[i].feature[3] = w->splats[i].depth;
        w->entry[i] = (TileEntry){(uint32_t)i, 0xffffffffu, (uint32_t)i};
    }
    for (int t = 0; t < TILES; t++) {
        RasterTile tile = tile_of(w, t);
        fs_raster_scalar.forward(&tile, feature[t], transmittance[t]);
        for (int i = 0; i < FEATURES * FS_TILE_PIXELS; i++) loss += w->want[t][i] * feature[t][i];
        for (int i = 0; i < FS_TILE_PIXELS; i++) loss += w->want_t[t][i] * transmittance[t][i];
    }
    return loss;
}

static void gradients(World *w)
{
    static double feature[TILES][FEATURES * FS_TILE_PIXELS], transmittance[TILES][FS_TILE_PIXELS];
    render(w, feature, transmittance);
    memset(w->moments, 0, sizeof w->moments);
    for (int t = 0; t < TILES; t++) {
        RasterTile tile = tile_of(w, t);
        double records[N * FS_RECORD];
        fs_raster_scalar.backward(&tile, feature[t], transmittance[t], w->want[t], w->want_t[t], records);
        for (int i = 0; i < N * FS_RECORD; i++) w->moments[i] += records[i];
    }
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) w->d_colors[3 * i + k] = w->moments[i * FS_RECORD + 6 + k];
        w->d_depth[i] = w->moments[i * FS_RECORD + 9];
    }
    ProjectParams params = {w->means, w->scales, w->quats, w->opacities};
    ProjectParams d = {w->d_means, w->d_scales, w->d_quats, w->d_opacities};
    ProjectBack from = {w->splats, w->moments, w->d_depth};
    fs_project_scalar.backward(&w->camera, &params, 0, N, &from, &d);
}

static void check_field(World *w, double *value, const double *gradient, int n, const char *name)
{
    static double feature[TILES][FEATURES * FS_TILE_PIXELS], transmittance[TILES][FS_TILE_PIXELS];
    double largest = 0, worst = 0;
    for (int i = 0; i < n; i++) largest = fmax(largest, fabs(gradient[i]));
    assert_true(largest > 0);
    for (int i = 0; i < n; i++) {
        const double step = 1e-5;
        double at = value[i];
        value[i] = at + step;
        double up = render(w, feature, transmittance);
        value[i] = at - step;
        double down = render(w, feature, transmittance);
        value[i] = at;
        double slope = (up - down) / (2 * step),
               error = fabs(slope - gradient[i]) / (fabs(gradient[i]) + 1e-3 * largest);
        if (error > 1e-5) print_message("%s %d: differences %.9g, gradient %.9g\n", name, i, slope, gradient[i]);
        worst = fmax(worst, error);
    }
    assert_true(worst < 1e-5);
}

static void test_parameters(void **state)
{
    (void)state;
    World *w = make_world();
    gradients(w);
    for (int i = 0; i < N; i++) assert_true(w->splats[i].tile[0] < w->splats[i].tile[2]); // all are seen
    check_field(w, w->means, w->d_means, N * 3, "mean");
    check_field(w, w->scales, w->d_scales, N * 3, "scale");
    check_field(w, w->quats, w->d_quats, N * 4, "quaternion");
    check_field(w, w->opacities, w->d_opacities, N, "opacity");
    check_field(w, w->colors, w->d_colors, N * 3, "colour");
    free(w);
}

// Where alpha is held at 0.99, opacity has no say.
static void test_clamp(void **state)
{
    (void)state;
    World *w = make_world();
    for (int i = 0; i < N; i++) {
        w->opacities[i] = 12;
        for (int k = 0; k < 3; k++) w->scales[3 * i + k] = 4;
    }
    gradients(w);
    for (int i = 0; i < N; i++) assert_true(w->d_opacities[i] == 0);
    assert_true(w->d_colors[0] != 0);
    free(w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_parameters), cmocka_unit_test(test_clamp)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

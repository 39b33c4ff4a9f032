// What the start makes of the points that it found: seeds, their colours, T's rear, and what is dropped.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>

#include "image/fill.h"
#include "initialise/constants.h"
#include "initialise/first_colors.h"
#include "initialise/outliers.h"
#include "initialise/rear.h"
#include "initialise/seeds.h"
#include "initialise/start.h"
#include "made_capture.h"

enum { SIDE = 300 };
static SmallViews views;
static MadeTexture texture_T, texture_R;
static float points_T[3 * SIDE], points_R[3 * SIDE];

static int set_up(void **state)
{
    (void)state;
    made_scatter(points_T, SIDE, MADE_DEPTH_T, 4);
    made_scatter(points_R, SIDE, MADE_DEPTH_R, 5);
    return made_capture(&views, &texture_T, &texture_R, NULL);
}

static int tear_down(void **state)
{
    (void)state;
    fs_small_views_free(&views);
    return 0;
}

// Inverse depth of a far wall and of a floor in the middle view's direction (x / z, y / z).
static double wall_and_floor(double x, double y)
{
    return fmax(0.3 + 0.05 * x, 1.1 * y);
}

// A point in the middle view, of this inverse depth.
static void place(double x, double y, double inverse, float xyz[3])
{
    const double ray[3] = {x, y, 1}; // all cameras look along z
    for (int k = 0; k < 3; k++) xyz[k] = (float)(views.centre[k] + ray[k] / inverse);
}

static void test_rear(void **state)
{
    (void)state;
    enum { N = 3000, SEEDS = 40, POINTS = 8 };
    float *xyz = malloc(sizeof(float) * 3 * N), *other = malloc(sizeof(float) * 3 * N);
    Rng rng = fs_rng_new(5);
    Rear rear;
    ColoredSeeds seeds = {.T = {SEEDS, malloc(sizeof(float) * 3 * SEEDS), malloc(sizeof(float) * SEEDS), POINTS}};
    for (int i = 0; i < N; i++) { // six of ten at the rear, the others before it; a cloud
        double x = (double)fs_rng_uniform(&rng) - 0.5, y = (double)fs_rng_uniform(&rng) - 0.5;
        double inverse = wall_and_floor(x, y) * (i % 10 < 6 ? 1 : 1.1 + (double)fs_rng_uniform(&rng));
        place(x, y, inverse, xyz + 3 * i);
        place(x, y, 0.2 + (double)fs_rng_uniform(&rng), other + 3 * i);
    }
    seeds.T_N = ARENA_NEW(&seeds.arena, float, 3 * SEEDS);
    seeds.T_F = ARENA_NEW(&seeds.arena, float, 3 * SEEDS);
    seeds.gain = ARENA_NEW(&seeds.arena, float, SEEDS);
    for (int i = 0; i < SEEDS; i++) { // every other one at the rear already
        double x = 0.02 * i - 0.4, y = 0.4 - 0.02 * i;
        place(x, y, wall_and_floor(x, y) * (i % 2 ? 1 : 1.5), seeds.T.xyz + 3 * i);
        seeds.T.scale[i] = seeds.gain[i] = (float)i;
        for (int c = 0; c < 3; c++) seeds.T_N[3 * i + c] = seeds.T_F[3 * i + c] = (float)(3 * i + c);
    }
    const PointList cloud = {.n = N, .xyz = other}, scene = {.n = N, .xyz = xyz}, none = {0};
    assert_int_equal(fs_rear_find(&views, &none, 1, &rear, NULL), 0);
    assert_int_equal(rear.n, 0);
    assert_int_equal(fs_rear_find(&views, &cloud, 1, &rear, NULL), 0);
    assert_int_equal(rear.n, 0);
    assert_int_equal(fs_rear_find(&views, &scene, 1, &rear, NULL), 0);
    assert_int_equal(rear.n, 2);
    assert_int_equal(fs_rear_add(&views, &rear, &seeds, NULL), 0);
    assert_int_equal(seeds.T.n, SEEDS + (SEEDS - POINTS) / 2);
    for (int i = SEEDS; i < seeds.T.n; i++) {
        int from = POINTS + 2 * (i - SEEDS);
        float uvl[3];
        assert_true(fs_small_views_direction(&views, seeds.T.xyz + 3 * i, uvl));
        assert_float_equal(exp(-(double)uvl[2]) / wall_and_floor(uvl[0], uvl[1]), 1, 0.01);
        assert_float_equal(seeds.T_N[3 * i + 2], 3 * from + 2, 0);
        assert_float_equal(seeds.T_F[3 * i], 3 * from, 0);
        assert_float_equal(seeds.gain[i], from, 0);
        assert_float_equal(seeds.T.scale[i], 1.5 * from, 0.02 * from);
    }
    fs_colored_seeds_free(&seeds);
    free(xyz);
    free(other);
}

// Mirrored seeds before what is behind the pane; where they are many they stay.
static void test_before(void **state)
{
    (void)state;
    enum { SURFACE = 600, SEEDS = 200 };
    float surface_xyz[3 * SURFACE], seed_xyz[3 * SEEDS], scale[SEEDS] = {0};
    unsigned char before[SEEDS];
    const PointList surface = {.n = SURFACE, .xyz = surface_xyz}, none = {0};
    const Seeds seeds = {SEEDS, seed_xyz, scale};
    made_scatter(surface_xyz, SURFACE, 2, 1);
    for (int near = 20; near <= 80; near += 60) {
        bool many = near > BEFORE_MOST * SEEDS;
        made_scatter(seed_xyz, near, 1.8, 2);
        made_scatter(seed_xyz + 3 * (size_t)near, SEEDS - near, 3, 3);
        assert_int_equal(fs_outliers_before(&views, &surface, &seeds, NULL, before, NULL), 0);
        for (int i = 0; i < SEEDS; i++) assert_int_equal(before[i], i < near && !many);
        assert_int_equal(fs_outliers_before(&views, &none, &seeds, NULL, before, NULL), 0);
        for (int i = 0; i < SEEDS; i++) assert_int_equal(before[i], 0);
    }
}

// Transmitted sparse points on the plane z = 1, mirrored ones on z = 2: dense points of either scene, and one thing
// that only the mirrored scene's dense points know, near the first plane but not on it.
static void test_outliers(void **state)
{
    (void)state;
    enum { ROW = 8, N = 2 * ROW * ROW };
    float xyz[3 * N], dense_xyz[3 * 3];
    unsigned char kind[N], unsure[N] = {0};
    for (int i = 0; i < N; i++) {
        bool mirrored = i >= N / 2;
        xyz[3 * i] = 0.1f * (float)(i % ROW);
        xyz[3 * i + 1] = 0.1f * (float)(i / ROW % ROW);
        xyz[3 * i + 2] = mirrored ? 2 : 1;
        kind[i] = mirrored ? POINT_REFLECTED : POINT_TRANSMITTED;
    }
    const float at[3] = {1.0f, 1.3f, 1.9f}; // on the one plane, between, by the other
    for (int reflected = 0; reflected < 2; reflected++) {
        for (int i = 0; i < 3; i++) memcpy(dense_xyz + 3 * i, (float[3]){0.31f, 0.29f, at[i]}, sizeof(float) * 3);
        PointList dense = {3, dense_xyz, 0};
        SparsePoints held = {.n = N, .xyz = xyz, .kind = unsure};
        assert_int_equal(fs_outliers_drop(&held, reflected, NULL, &dense, NULL), 0);
        assert_int_equal(dense.n, 3); // nothing to hold them against
        held.kind = kind;
        assert_int_equal(fs_outliers_drop(&held, reflected, NULL, &dense, NULL), 0);
        assert_int_equal(dense.n, 2);
        assert_float_equal(dense.xyz[2], reflected ? 1.3f : 1.0f, 0);
        assert_float_equal(dense.xyz[5], reflected ? 1.9f : 1.3f, 0);
    }
}

static void test_fill(void **state)
{
    (void)state;
    enum { W = 13, H = 7 };
    float value[W * H] = {0}, weight[W * H] = {0};
    bool any = true;
    assert_int_equal(fs_fill_holes(value, weight, W, H, 1, &any, NULL), 0);
    assert_false(any);
    value[3] = 10; // weight 5: 2
    weight[3] = 5;
    value[W * H - 1] = 2;
    weight[W * H - 1] = 1;
    assert_int_equal(fs_fill_holes(value, weight, W, H, 1, &any, NULL), 0);
    assert_true(any);
    for (int i = 0; i < W * H; i++) assert_true(fabsf(value[i] - 2) < 1e-5f);
    memset(weight, 0, sizeof weight);
    memset(value, 0, sizeof value);
    weight[0] = weight[W - 1] = 1;
    value[W - 1] = 1;
    assert_int_equal(fs_fill_holes(value, weight, W, H, 1, &any, NULL), 0);
    assert_true(value[0] == 0 && value[W - 1] == 1);
    assert_true(value[W / 2] > 0.2f && value[W / 2] < 0.8f);
    assert_true(value[2] < value[W - 3]);
}

static void test_seeds(void **state)
{
    (void)state;
    enum { COUNT = 3000, CELL = 8 };
    PointList list = {SIDE, points_T, 0};
    Seeds seeds, again;
    assert_int_equal(fs_seeds_make(&views, &list, COUNT, 7, NULL, &seeds, NULL), 0);
    assert_int_equal(fs_seeds_make(&views, &list, COUNT, 7, NULL, &again, NULL), 0);
    assert_int_equal(seeds.n, COUNT);
    assert_memory_equal(seeds.xyz, again.xyz, sizeof(float) * 3 * COUNT);
    for (int i = 0; i < COUNT; i++) {
        assert_true(seeds.scale[i] > 0 && isfinite(seeds.scale[i]));
        assert_true(fabs((double)seeds.xyz[3 * i + 2] / MADE_DEPTH_T - 1) < 0.2);
    }
    for (int f = 0; f < views.n; f++) { // no part of any photo is without a seed
        bool covered[MADE_HEIGHT / CELL][MADE_WIDTH / CELL] = {{0}};
        for (int i = 0; i < COUNT; i++) {
            double p[3] = {seeds.xyz[3 * i], seeds.xyz[3 * i + 1], seeds.xyz[3 * i + 2]}, pixel[2];
            if (!(fs_camera_project(&views.view[f].camera, p, pixel) > 0)) continue;
            if (pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < MADE_WIDTH && pixel[1] < MADE_HEIGHT)
                covered[(int)pixel[1] / CELL][(int)pixel[0] / CELL] = true;
        }
        for (int c = 0; c < MADE_HEIGHT / CELL * (MADE_WIDTH / CELL); c++)
            assert_true(covered[c / (MADE_WIDTH / CELL)][c % (MADE_WIDTH / CELL)]);
    }
    fs_seeds_free(&seeds);
    fs_seeds_free(&again);
    float two[3 * (SIDE + 1)]; // a near point alone is a seed, and nothing around it
    memcpy(two, points_T, sizeof(float) * 3 * SIDE);
    memcpy(two + 3 * SIDE, (float[3]){0, 0, 0.5f * (float)MADE_DEPTH_T}, sizeof(float) * 3);
    list = (PointList){SIDE + 1, two, 1};
    assert_int_equal(fs_seeds_make(&views, &list, COUNT, 7, NULL, &seeds, NULL), 0);
    int near = 0;
    for (int i = 0; i < COUNT; i++) near += (double)seeds.xyz[3 * i + 2] < 0.7 * MADE_DEPTH_T;
    assert_true(near >= 1 && near < COUNT / SIDE * 3);
    fs_seeds_free(&seeds);
}

enum { COLORED = 3000 };

static void found_colors(ColoredSeeds *seeds, float alpha, double *error_T, double *error_R)
{
    const PointList at_T = {SIDE, points_T, 0}, at_R = {SIDE, points_R, 0};
    assert_int_equal(fs_seeds_make(&views, &at_T, COLORED, 7, NULL, &seeds->T, NULL), 0);
    assert_int_equal(fs_seeds_make(&views, &at_R, COLORED, 8, NULL, &seeds->R, NULL), 0);
    for (int i = 0; i < 3 * COLORED; i++) seeds->alpha[i] = alpha;
    for (int i = 0; i < COLORED; i++) seeds->gain[i] = logf(alpha);
    assert_int_equal(fs_first_colors_find(&views, seeds, NULL, NULL), 0);
    *error_T = *error_R = 0;
    for (int i = 0; i < 3 * COLORED; i++) {
        const float *t = seeds->T.xyz + i / 3 * 3, *r = seeds->R.xyz + i / 3 * 3;
        assert_true(seeds->T_N[i] >= 0 && seeds->T_F[i] >= 0 && seeds->R_color[i] >= 0);
        *error_T += fabs((double)(seeds->T_N[i] - made_texture_at(&texture_T, i % 3, (double)t[0], (double)t[1]))) /
                    (3 * COLORED);
        *error_R += fabs((double)(seeds->R_color[i] - made_texture_at(&texture_R, i % 3, (double)r[0], (double)r[1]))) /
                    (3 * COLORED);
    }
}

static void test_first_colors(void **state)
{
    (void)state;
    static float alpha[3 * COLORED], T_N[3 * COLORED], T_F[3 * COLORED], R_color[3 * COLORED], gain[COLORED];
    ColoredSeeds seeds = {.T_N = T_N, .T_F = T_F, .R_color = R_color, .alpha = alpha, .gain = gain};
    // Alpha as measured; six times that, as carried over from what the flash lights more. With that T_N would be a
    // sixth of what it is, 0.15 to 0.16 off at the end, and gains 7.2, if no photo had a say.
    for (int k = 1; k <= 6; k += 5) {
        double error_T, error_R, ratio = 0, gains = 0;
        found_colors(&seeds, (float)k * MADE_ALPHA, &error_T, &error_R);
        for (int i = 0; i < 3 * COLORED; i++) ratio += (double)(T_F[i] / T_N[i]) / (3 * COLORED);
        for (int i = 0; i < COLORED; i++) gains += exp((double)gain[i]) / COLORED;
        assert_true(error_T < (k == 1 ? 0.03 : 0.14)); // of 0.2; half of the light would be 0.05 off by texture alone
        assert_true(error_R < (k == 1 ? 0.03 : 0.14));
        assert_true(k > 1 || fabs(ratio - (double)(1 + MADE_ALPHA)) < 0.3);
        assert_true(gains < (k == 1 ? 1.3 : 4));
        fs_seeds_free(&seeds.T);
        fs_seeds_free(&seeds.R);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rear), cmocka_unit_test(test_outliers), cmocka_unit_test(test_before),
        cmocka_unit_test(test_fill), cmocka_unit_test(test_seeds),    cmocka_unit_test(test_first_colors),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

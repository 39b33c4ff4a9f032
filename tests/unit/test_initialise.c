// The start of training on a made-up capture whose two scenes are known.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>

#include "image/fill.h"
#include "initialise/constants.h"
#include "initialise/cue.h"
#include "initialise/depth_cue.h"
#include "initialise/stereo.h"
#include "initialise/light.h"
#include "initialise/first_colors.h"
#include "initialise/seeds.h"
#include "initialise/start.h"
#include "initialise/outliers.h"
#include "initialise/edge_windows.h"
#include "initialise/rear.h"
#include "made_capture.h"

static SmallViews views;
static MadeTexture texture_T, texture_R;

static int set_up(void **state)
{
    (void)state;
    return made_capture(&views, &texture_T, &texture_R, NULL);
}

static int tear_down(void **state)
{
    (void)state;
    fs_small_views_free(&views);
    return 0;
}

// n points on a plane, within the view of all cameras.
static void scatter(float *xyz, int n, double depth, uint64_t seed)
{
    Rng rng = fs_rng_new(seed);
    for (int i = 0; i < n; i++) {
        xyz[3 * i] = (fs_rng_uniform(&rng) - 0.5f) * 0.4f * (float)depth;
        xyz[3 * i + 1] = (fs_rng_uniform(&rng) - 0.5f) * 0.25f * (float)depth;
        xyz[3 * i + 2] = (float)depth;
    }
}

static void test_slope(void **state)
{
    (void)state;
    double coherence;
    assert_true(fabs(fs_cue_slope(1, 2, 4, 1, 4, &coherence) - 2) < 1e-12);
    assert_true(fabs(coherence - 1) < 1e-12);
    assert_true(fabs(fs_cue_slope(3, 3, 3, 6, 6, &coherence) - 1) < 1e-12);
    assert_true(fabs(coherence - 6.0 / 9) < 1e-12);
    assert_true(fs_cue_slope(1e-9, 0, 4, 1, 8, &coherence) == CUE_SLOPE_MAX); // black without flash
    assert_true(fabs(coherence - 0.5) < 0.01);
    assert_true(fs_cue_slope(4, 0, 1e-9, 8, 1, &coherence) == 0);
    assert_true(fs_cue_slope(-1, -2, -4, 1, 1, &coherence) == 0 && coherence == 0);
    assert_true(fs_cue_slope(1, NAN, NAN, 1, 1, &coherence) == 0);
}

static void test_cue(void **state)
{
    (void)state;
    enum { N = 60 };
    float xyz[3 * N];
    Cue cue[N];
    scatter(xyz, N, MADE_DEPTH_T, 1);
    fs_cue_measure(&views, xyz, N, cue, NULL);
    for (int i = 0; i < N; i++) {
        assert_true(cue[i].ok);
        assert_true(fabsf(expf(cue[i].log_slope) - (1 + MADE_ALPHA)) < 0.35f);
        assert_true(cue[i].sigma < 0.3f);
    }
    scatter(xyz, N, MADE_DEPTH_R, 2);
    fs_cue_measure(&views, xyz, N, cue, NULL);
    double mean = 0;
    for (int i = 0; i < N; i++) mean += (double)cue[i].log_slope / N;
    assert_true(fabs(mean) < 0.1);
    scatter(xyz, N, 0.9, 2); // nothing is there
    fs_cue_measure(&views, xyz, N, cue, NULL);
    int ok = 0;
    for (int i = 0; i < N; i++) ok += cue[i].ok && cue[i].coherence > 0.3f;
    assert_true(ok < N / 10);
    float behind[3] = {0, 0, -1};
    fs_cue_measure(&views, behind, 1, cue, NULL);
    assert_false(cue[0].ok);
}

enum { SIDE = 300, ODD = 60, ALL = 2 * SIDE + ODD };
static float points[3 * ALL];
static Cue cues[ALL];
static unsigned char kinds[ALL];
static DepthOdds odds;

static SparsePoints sparse(unsigned char *kind)
{
    return (SparsePoints){.n = ALL, .xyz = points, .cue = cues, .kind = kind};
}

static void classify(Threads *threads, unsigned char *kind)
{
    scatter(points, SIDE, MADE_DEPTH_T, 4);
    scatter(points + 3 * SIDE, SIDE, MADE_DEPTH_R, 5);
    scatter(points + 6 * SIDE, ODD, 2.8, 6); // in neither scene
    fs_cue_measure(&views, points, ALL, cues, threads);
    SparsePoints all = sparse(kind);
    assert_int_equal(fs_classify_points(&views, &all, &odds, threads, NULL), 0);
}

static void test_classify(void **state)
{
    (void)state;
    unsigned char again[ALL];
    Threads *threads = fs_threads_new(3);
    classify(threads, kinds);
    classify(NULL, again);
    assert_memory_equal(kinds, again, ALL);
    int right[2] = {0}, wrong[2] = {0};
    for (int i = 0; i < 2 * SIDE; i++) {
        int R = i >= SIDE, said_R = kinds[i] == POINT_REFLECTED;
        if (kinds[i] == POINT_UNSURE) continue;
        right[R] += R == said_R;
        wrong[R] += R != said_R;
    }
    assert_true(right[0] > 0.9 * SIDE && right[1] > 0.8 * SIDE);
    assert_true(wrong[0] + wrong[1] <= 0.01 * SIDE);
    fs_threads_free(threads);
}

// The scenes parted by the depth up to which flash photos find more points than the others.
static void test_depth_cue(void **state)
{
    (void)state;
    double depth;
    int sightings[ALL][2];
    float xyz[3 * ALL];
    unsigned char kind[ALL];
    FsError err = {0};
    scatter(xyz, SIDE, MADE_DEPTH_T, 4);
    scatter(xyz + 3 * SIDE, SIDE, MADE_DEPTH_R, 5);
    scatter(xyz + 6 * SIDE, ODD, 2.8, 6);
    SparsePoints all = {.n = ALL, .xyz = xyz, .kind = kind, .sightings = sightings};
    for (int i = 0; i < ALL;
         i++) { // in front and mirrored: half of the points by either lighting; behind the pane: more
        sightings[i][0] = i % 2 ? 3 : 1;
        sightings[i][1] = i < SIDE || i % 2 == 0 ? 3 : 1;
    }
    assert_int_equal(fs_depth_cue_find(&views, &all, &depth, &err), 0);
    assert_true(depth > MADE_DEPTH_T && depth < MADE_DEPTH_R);
    assert_int_equal(fs_depth_cue_part(&views, depth, &all), SIDE + (depth < 2.8 ? ODD : 0));
    for (int i = 0; i < 2 * SIDE; i++) assert_int_equal(kind[i], i < SIDE ? POINT_TRANSMITTED : POINT_REFLECTED);
    for (int i = 0; i < ALL; i++) sightings[i][0] = sightings[i][1] = 2;
    assert_int_equal(fs_depth_cue_find(&views, &all, &depth, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "--flash-cue contrast"));
    for (int i = 0; i < ALL; i++) xyz[3 * i + 2] = -1;
    assert_int_equal(fs_depth_cue_find(&views, &all, &depth, &err), FS_ERR_INPUT);
}

static void test_light(void **state)
{
    (void)state;
    FlashLight light;
    float gain[ALL];
    SparsePoints all = sparse(kinds);
    const Seeds at = {.n = SIDE, .xyz = points};
    assert_int_equal(fs_light_fit(&views, &all, &light, NULL), 0);
    assert_true(fabs(light.mean_slope - (double)(1 + MADE_ALPHA)) < 0.2);
    assert_int_equal(fs_light_gains(&views, &light, &all, &at, gain, NULL, NULL), 0);
    double mean = 0;
    for (int i = 0; i < SIDE; i++)
        mean += light.color[1] * exp((double)gain[i]) * fs_light_falloff(&views, &light, points + 3 * i) / SIDE;
    assert_true(fabs(mean - (double)MADE_ALPHA) < 0.2);
    unsigned char none[ALL] = {0}; // no transmitted points: a neutral guess, no failure
    all.kind = none;
    assert_int_equal(fs_light_fit(&views, &all, &light, NULL), 0);
    assert_true(light.color[0] == 1 && light.distance > 0);
    assert_int_equal(fs_light_gains(&views, &light, &all, &at, gain, NULL, NULL), 0);
    assert_true(gain[0] == 0 && gain[SIDE - 1] == 0);
}

static double share_at(const PointList *p, double depth, double tolerance)
{
    int n = 0;
    for (int i = 0; i < p->n; i++) n += fabs((double)p->xyz[3 * (size_t)i + 2] / depth - 1) < tolerance;
    return p->n ? (double)n / p->n : 0;
}

static void find_both(unsigned char *kind, Threads *threads, PointList *T, PointList *R)
{
    static const Log quiet;
    DepthMaps maps;
    SparsePoints all = sparse(kind);
    const Start start = {.views = &views, .points = &all, .odds = &odds, .threads = threads, .log = &quiet};
    assert_int_equal(fs_stereo_find(&start, &maps, NULL), 0);
    assert_int_equal(fs_stereo_fuse(&maps, false, 2, T, NULL), 0);
    assert_int_equal(fs_stereo_fuse(&maps, true, 2, R, NULL), 0);
    fs_stereo_free(&maps);
}

static void test_stereo(void **state)
{
    (void)state;
    PointList T, R, T2, R2;
    Threads *threads = fs_threads_new(3);
    find_both(kinds, threads, &T, &R);
    find_both(kinds, NULL, &T2, &R2);
    assert_true(T.n > 4000);
    assert_true(R.n > 2000);
    assert_true(share_at(&T, MADE_DEPTH_T, 0.04) > 0.95);
    assert_true(share_at(&R, MADE_DEPTH_R, 0.1) > 0.9);
    assert_int_equal(T.n, T2.n);
    assert_int_equal(R.n, R2.n);
    assert_memory_equal(T.xyz, T2.xyz, sizeof(float) * 3 * (size_t)T.n);
    assert_memory_equal(R.xyz, R2.xyz, sizeof(float) * 3 * (size_t)R.n);
    fs_points_list_free(&T);
    fs_points_list_free(&R);
    fs_points_list_free(&T2);
    fs_points_list_free(&R2);
    fs_threads_free(threads);
}

static void test_stereo_without_points(void **state)
{
    (void)state;
    PointList T, R;
    unsigned char none[ALL] = {0};
    find_both(none, NULL, &T, &R);
    assert_int_equal(T.n, 0);
    assert_int_equal(R.n, 0);
}

// Mirrored points that were taken for transmitted ones, at depths that say so: found again all the same, and marked.
static void test_near_mirrored(void **state)
{
    (void)state;
    static const Log quiet;
    FlashLight light;
    PointList dense[2];
    unsigned char kind[ALL];
    DepthOdds tilted = odds;
    SparsePoints all = sparse(kind);
    Threads *threads = fs_threads_new(2);
    Start start = {.views = &views, .points = &all, .odds = &odds, .light = &light, .threads = threads, .log = &quiet};
    memcpy(kind, kinds, ALL);
    assert_int_equal(fs_light_fit(&views, &all, &light, NULL), 0);
    assert_int_equal(fs_residual_stereo_find(&start, dense, NULL), 0);
    assert_int_equal(dense[1].alone, 0); // no lit things lie at their depth
    for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);

    for (int i = 0; i < ALL; i++)
        if (kind[i] == POINT_REFLECTED) kind[i] = POINT_TRANSMITTED;
    for (int d = 0; d < DEPTH_ODDS_STEPS; d++) tilted.odds[d] = 2.0f;
    start.odds = &tilted;
    assert_int_equal(fs_residual_stereo_find(&start, dense, NULL), 0);
    const PointList near = {.n = dense[1].alone, .xyz = dense[1].xyz + 3 * (size_t)(dense[1].n - dense[1].alone)};
    assert_true(near.n > 500);
    assert_true(share_at(&near, MADE_DEPTH_R, 0.1) > 0.9);
    for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);
    fs_threads_free(threads);
}

// A plane of little contrast behind a strongly textured mirrored one: hardly seen in the photos, but once the mirrored
// scene is subtracted from them.
static void test_dim_transmitted(void **state)
{
    (void)state;
    static const Log quiet;
    FlashLight light;
    SmallViews dim;
    MadeTexture T = texture_T;
    PointList at_once, dense[2];
    SparsePoints all = sparse(kinds);
    DepthMaps maps;
    for (int k = 0; k < 3 * MADE_WAVES; k++) T.wave[k / MADE_WAVES][k % MADE_WAVES][3] *= 0.2f;
    assert_int_equal(made_photos(&dim, &T, &texture_R, NULL), 0);
    Start start = {.views = &dim, .points = &all, .odds = &odds, .light = &light, .log = &quiet};
    assert_int_equal(fs_light_fit(&views, &all, &light, NULL), 0);
    assert_int_equal(fs_stereo_find(&start, &maps, NULL), 0);
    assert_int_equal(fs_stereo_fuse(&maps, false, STEREO_VOTES, &at_once, NULL), 0);
    assert_int_equal(fs_residual_stereo_find(&start, dense, NULL), 0);
    assert_true(share_at(&at_once, MADE_DEPTH_T, 0.04) < 0.9);
    assert_true(share_at(&dense[0], MADE_DEPTH_T, 0.04) > 0.95);
    assert_true(dense[0].n > 1.5 * at_once.n);
    fs_stereo_free(&maps);
    fs_points_list_free(&at_once);
    for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);
    fs_small_views_free(&dim);
}

// Points of the transmitted maps at the board's depth: [0] on it, [1] beside it.
static void count_board(const DepthMaps *maps, int count[2])
{
    PointList T;
    assert_int_equal(fs_stereo_fuse(maps, false, STEREO_VOTES, &T, NULL), 0);
    count[0] = count[1] = 0;
    for (int i = 0; i < T.n; i++) {
        const float *p = T.xyz + 3 * (size_t)i;
        if (fabs((double)p[2] / MADE_DEPTH_BOARD - 1) > 0.04) continue;
        count[fabs((double)p[0]) >= MADE_BOARD + 0.01]++;
    }
    fs_points_list_free(&T);
}

// A bright board before the transmitted plane: what is seen beside its edges is the plane.
static void test_beside_edge(void **state)
{
    (void)state;
    static const Log quiet;
    SmallViews with_board;
    MadeTexture behind = texture_T;
    const MadeTexture dark = {0};
    SparsePoints all = sparse(kinds);
    DepthMaps maps;
    int count[2];
    behind.board = true;
    assert_int_equal(made_photos(&with_board, &behind, &texture_R, NULL), 0);
    const Start start = {.views = &with_board, .points = &all, .odds = &odds, .log = &quiet};
    assert_int_equal(fs_stereo_find(&start, &maps, NULL), 0);
    count_board(&maps, count);
    assert_true(count[0] > 2500);
    assert_true(count[1] < 0.45 * count[0]); // 0.6 where bright pixels of the window count for more
    fs_small_views_free(&with_board);
    assert_int_equal(made_photos(&with_board, &behind, &dark, NULL), 0); // once the mirrored scene is subtracted
    assert_int_equal(fs_stereo_renew(&start, &with_board, AIM_TRANSMITTED, 1, &maps, NULL), 0);
    count_board(&maps, count);
    int before = count[1];
    assert_int_equal(fs_stereo_renew(&start, &with_board, AIM_EDGES, 1, &maps, NULL), 0);
    count_board(&maps, count);
    assert_true(count[0] > 2500);
    assert_true(count[1] < 0.1 * before);
    fs_stereo_free(&maps);
    fs_small_views_free(&with_board);
}

// A bright half beside a dark one, both with a fine texture.
static void test_edge_windows(void **state)
{
    (void)state;
    enum { W = 40, H = 24, EDGE = W / 2 };
    Image photo, fine;
    EdgeWindows windows;
    assert_int_equal(fs_image_new(&photo, W, H, 3, NULL), 0);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++)
                fs_image_at(&photo, x, y)[c] = (x < EDGE ? 0.6f : 0.02f) * (1 + 0.04f * (float)((x + y + c) % 2));
    fs_image_at(&photo, 30, 12)[1] = NAN;
    assert_int_equal(fs_edge_windows_fine(&photo, &fine, NULL), 0);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++) { // no halo: what is left is the texture
                assert_true(fabsf(fs_image_at(&fine, x, y)[c]) < 0.03f * (x < EDGE ? 0.6f : 0.02f));
                assert_float_equal(fs_image_at(&fine, x, y)[3], x == 30 && y == 12 ? 0 : 1, 0);
            }
    assert_float_equal(fs_image_at(&fine, 30, 12)[0], 0, 0);
    assert_int_equal(fs_edge_windows_new(&photo, W, H, &windows, NULL), 0);
    float *values = aligned_alloc(64, sizeof(float) * W * H * EDGE_VALUES), sums[W * H * EDGE_VALUES];
    for (int i = 0; i < W * H * EDGE_VALUES; i++)
        values[i] = (float)(i / EDGE_VALUES % W < EDGE ? 1 + i % EDGE_VALUES : 0);
    fs_edge_windows_sum(&windows, values, sums);
    for (int i = 0; i < W * H * EDGE_VALUES; i++) {
        if (i / EDGE_VALUES == 12 * W + 30) continue; // it is taken for bright
        assert_float_equal(sums[i], values[i], 0.01); // weights sum to 1, and the window ends at the edge
    }
    free(values);
    fs_edge_windows_free(&windows);
    fs_image_free(&photo);
    fs_image_free(&fine);
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
    scatter(surface_xyz, SURFACE, 2, 1);
    for (int near = 20; near <= 80; near += 60) {
        bool many = near > BEFORE_MOST * SEEDS;
        scatter(seed_xyz, near, 1.8, 2);
        scatter(seed_xyz + 3 * (size_t)near, SEEDS - near, 3, 3);
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
    PointList list = {SIDE, points, 0};
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
    memcpy(two, points, sizeof(float) * 3 * SIDE);
    memcpy(two + 3 * SIDE, (float[3]){0, 0, 0.5f * (float)MADE_DEPTH_T}, sizeof(float) * 3);
    list = (PointList){SIDE + 1, two, 1};
    assert_int_equal(fs_seeds_make(&views, &list, COUNT, 7, NULL, &seeds, NULL), 0);
    int near = 0;
    for (int i = 0; i < COUNT; i++) near += (double)seeds.xyz[3 * i + 2] < 0.7 * MADE_DEPTH_T;
    assert_true(near >= 1 && near < COUNT / SIDE * 3);
    fs_seeds_free(&seeds);
}

static void test_first_colors(void **state)
{
    (void)state;
    enum { COUNT = 3000 };
    static float alpha[3 * COUNT], T_N[3 * COUNT], T_F[3 * COUNT], R_color[3 * COUNT];
    const PointList at_T = {SIDE, points, 0}, at_R = {SIDE, points + 3 * SIDE, 0};
    ColoredSeeds seeds = {.T_N = T_N, .T_F = T_F, .R_color = R_color, .alpha = alpha};
    assert_int_equal(fs_seeds_make(&views, &at_T, COUNT, 7, NULL, &seeds.T, NULL), 0);
    assert_int_equal(fs_seeds_make(&views, &at_R, COUNT, 8, NULL, &seeds.R, NULL), 0);
    for (int i = 0; i < 3 * COUNT; i++) alpha[i] = MADE_ALPHA;
    assert_int_equal(fs_first_colors_find(&views, &seeds, NULL, NULL), 0);
    double error_T = 0, error_R = 0, ratio = 0;
    for (int i = 0; i < 3 * COUNT; i++) {
        const float *t = seeds.T.xyz + i / 3 * 3, *r = seeds.R.xyz + i / 3 * 3;
        assert_true(T_N[i] >= 0 && T_F[i] >= 0 && R_color[i] >= 0);
        error_T +=
            fabs((double)(T_N[i] - made_texture_at(&texture_T, i % 3, (double)t[0], (double)t[1]))) / (3 * COUNT);
        error_R +=
            fabs((double)(R_color[i] - made_texture_at(&texture_R, i % 3, (double)r[0], (double)r[1]))) / (3 * COUNT);
        ratio += (double)(T_F[i] / T_N[i]) / (3 * COUNT);
    }
    assert_true(error_T < 0.03 &&
                error_R < 0.03); // of 0.2; half of the photo's light would be 0.05 off by the texture alone
    assert_true(fabs(ratio - (double)(1 + MADE_ALPHA)) < 0.3);
    fs_seeds_free(&seeds.T);
    fs_seeds_free(&seeds.R);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slope),
        cmocka_unit_test(test_cue),
        cmocka_unit_test(test_classify),
        cmocka_unit_test(test_light),
        cmocka_unit_test(test_depth_cue),
        cmocka_unit_test(test_stereo),
        cmocka_unit_test(test_stereo_without_points),
        cmocka_unit_test(test_near_mirrored),
        cmocka_unit_test(test_dim_transmitted),
        cmocka_unit_test(test_beside_edge),
        cmocka_unit_test(test_edge_windows),
        cmocka_unit_test(test_rear),
        cmocka_unit_test(test_outliers),
        cmocka_unit_test(test_before),
        cmocka_unit_test(test_fill),
        cmocka_unit_test(test_seeds),
        cmocka_unit_test(test_first_colors),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

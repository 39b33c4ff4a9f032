// The start of training on a made-up capture whose two scenes are known.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>

#include "initialise/constants.h"
#include "initialise/cue.h"
#include "initialise/depth_cue.h"
#include "initialise/lamp_depth.h"
#include "initialise/stereo.h"
#include "initialise/light.h"
#include "initialise/start.h"
#include "initialise/edge_windows.h"
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
    made_scatter(xyz, N, MADE_DEPTH_T, 1);
    fs_cue_measure(&views, xyz, N, cue, NULL);
    for (int i = 0; i < N; i++) {
        assert_true(cue[i].ok);
        assert_true(fabsf(expf(cue[i].log_slope) - (1 + MADE_ALPHA)) < 0.35f);
        assert_true(cue[i].sigma < 0.3f);
    }
    made_scatter(xyz, N, MADE_DEPTH_R, 2);
    fs_cue_measure(&views, xyz, N, cue, NULL);
    double mean = 0;
    for (int i = 0; i < N; i++) mean += (double)cue[i].log_slope / N;
    assert_true(fabs(mean) < 0.1);
    made_scatter(xyz, N, 0.9, 2); // nothing is there
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
    made_scatter(points, SIDE, MADE_DEPTH_T, 4);
    made_scatter(points + 3 * SIDE, SIDE, MADE_DEPTH_R, 5);
    made_scatter(points + 6 * SIDE, ODD, 2.8, 6); // in neither scene
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

// Points at a depth whose contrast grows by so much.
typedef struct Grown {
    int n;
    double depth, growth, sigma;
} Grown;

enum { GROWN = 4, GROWN_MOST = 600 };

// Of each group, how many are called mirrored.
static void classify_grown(const Grown group[GROWN], int mirrored[GROWN], double *rare)
{
    static float xyz[3 * GROWN_MOST];
    static Cue cue[GROWN_MOST];
    static unsigned char kind[GROWN_MOST];
    SparsePoints all = {.xyz = xyz, .cue = cue, .kind = kind};
    DepthOdds depths;
    for (int g = 0; g < GROWN; all.n += group[g++].n) {
        made_scatter(xyz + 3 * all.n, group[g].n, group[g].depth, 7 + (unsigned)g);
        for (int i = all.n; i < all.n + group[g].n; i++) {
            float spread = (float)(group[g].sigma * ((i * 7 % 11) / 5.0 - 1));
            cue[i] = (Cue){.log_slope = (float)log(group[g].growth) + spread,
                           .sigma = (float)group[g].sigma,
                           .coherence = 0.5f,
                           .ok = true};
        }
    }
    assert_int_equal(fs_classify_points(&views, &all, &depths, NULL, NULL), 0);
    *rare = (double)depths.rare;
    for (int g = 0, i = 0; g < GROWN; g++) {
        mirrored[g] = 0;
        for (int end = i + group[g].n; i < end; i++) mirrored[g] += kind[i] == POINT_REFLECTED;
    }
}

// Far behind the pane the flash adds little, and hardly anything is mirrored: what grows by half is not.
static void test_little_mirrored(void **state)
{
    (void)state;
    double rare;
    int mirrored[GROWN];
    const Grown clear[GROWN] = {{300, 1.5, 3, 0.1}, {120, 2.8, 1.4, 0.35}, {80, 3, 1.15, 0.3}, {30, 4.5, 1.02, 0.05}};
    classify_grown(clear, mirrored, &rare);
    assert_true(rare > 0);
    assert_true(mirrored[0] + mirrored[1] <= clear[1].n / 20);
    assert_true(mirrored[3] >= clear[3].n / 2);
    // Through bright things mirrored ones are seen so badly that they seem to grow, too: they are mirrored all the
    // same.
    const Grown blurred[GROWN] = {{300, 1.5, 3, 0.1}, {120, 2.8, 1.4, 0.35}, {80, 3, 1.15, 0.3}, {30, 4.5, 1.3, 0.3}};
    classify_grown(blurred, mirrored, &rare);
    assert_true(rare > 0);
    assert_true(mirrored[0] + mirrored[1] <= blurred[1].n / 20);
    assert_true(mirrored[3] >= blurred[3].n / 3);
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
    made_scatter(xyz, SIDE, MADE_DEPTH_T, 4);
    made_scatter(xyz + 3 * SIDE, SIDE, MADE_DEPTH_R, 5);
    made_scatter(xyz + 6 * SIDE, ODD, 2.8, 6);
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

// A lamp that all photos show clipped, so far away; radius 0: none.
static void clip_lamp(SmallViews *lit, double depth, double radius)
{
    const double lamp[3] = {0.06, 0.03, depth};
    for (int v = 0; v < lit->n; v++) {
        const Camera *camera = &lit->view[v].camera;
        double at[2], z = fs_camera_project(camera, lamp, at), r = camera->fx * radius / z;
        lit->view[v].clipped = calloc((size_t)camera->width * (size_t)camera->height, 1);
        assert_non_null(lit->view[v].clipped);
        for (int i = 0; i < camera->width * camera->height; i++) {
            double dx = i % camera->width + 0.5 - at[0], dy = (double)(i / camera->width) + 0.5 - at[1];
            lit->view[v].clipped[i] = dx * dx + dy * dy < r * r;
        }
    }
}

static void test_lamp_depth(void **state)
{
    (void)state;
    enum { N = 200 };
    float xyz[2][3 * N];
    made_scatter(xyz[0], N, MADE_DEPTH_T, 1);
    made_scatter(xyz[1], N, MADE_DEPTH_R, 2);
    const PointList dense[2] = {{.n = N, .xyz = xyz[0]}, {.n = N, .xyz = xyz[1]}}, none = {0};
    const PointList *const both[2] = {&dense[0], &dense[1]}, *const things[2] = {&dense[0], &none};
    static const double depth[] = {MADE_DEPTH_T, MADE_DEPTH_R, MADE_DEPTH_T}, radius[] = {0.02, 0.05, 0};
    for (int i = 0; i < 3; i++) {
        SmallViews lit;
        PointList behind;
        int judged;
        assert_int_equal(made_photos(&lit, &texture_T, &texture_R, NULL), 0);
        clip_lamp(&lit, depth[i], radius[i]);
        assert_int_equal(fs_lamp_depth_find(&lit, both, NULL, &behind, &judged, NULL), 0);
        assert_true(i == 2 ? judged == 0 : judged > 20);
        assert_true(i == 0 ? behind.n > 0.95 * judged : behind.n == 0);
        for (int k = 0; k < behind.n; k++) assert_true(fabs((double)behind.xyz[3 * k + 2] / MADE_DEPTH_T - 1) < 0.1);
        fs_points_list_free(&behind);
        assert_int_equal(fs_lamp_depth_find(&lit, things, NULL, &behind, &judged, NULL), 0);
        assert_int_equal(behind.n + judged, 0); // no room
        fs_small_views_free(&lit);
    }
}

// Both scenes reach to the lamp's depth: it belongs to the one that has points around it.
static void test_lamp_beside(void **state)
{
    (void)state;
    enum { N = 200 };
    float xyz[2][3 * N];
    for (int k = 0; k < 2; k++) made_scatter(xyz[k], N, MADE_DEPTH_T, 1 + (uint64_t)k);
    for (int i = 0; i < N; i++) xyz[1][3 * i] = 0.15f * xyz[1][3 * i] - 0.18f * (float)MADE_DEPTH_T; // at the left edge
    const PointList around = {.n = N, .xyz = xyz[0]}, aside = {.n = N, .xyz = xyz[1]};
    for (int k = 0; k < 2; k++) {
        const PointList *const dense[2] = {k ? &aside : &around, k ? &around : &aside};
        SmallViews lit;
        PointList behind;
        int judged;
        assert_int_equal(made_photos(&lit, &texture_T, &texture_R, NULL), 0);
        clip_lamp(&lit, MADE_DEPTH_T, 0.02);
        assert_int_equal(fs_lamp_depth_find(&lit, dense, NULL, &behind, &judged, NULL), 0);
        assert_true(judged > 20);
        assert_true(k ? behind.n == 0 : behind.n > 0.95 * judged);
        fs_points_list_free(&behind);
        fs_small_views_free(&lit);
    }
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slope),         cmocka_unit_test(test_cue),
        cmocka_unit_test(test_classify),      cmocka_unit_test(test_little_mirrored),
        cmocka_unit_test(test_light),         cmocka_unit_test(test_depth_cue),
        cmocka_unit_test(test_stereo),        cmocka_unit_test(test_stereo_without_points),
        cmocka_unit_test(test_near_mirrored), cmocka_unit_test(test_dim_transmitted),
        cmocka_unit_test(test_beside_edge),   cmocka_unit_test(test_lamp_depth),
        cmocka_unit_test(test_lamp_beside),   cmocka_unit_test(test_edge_windows),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

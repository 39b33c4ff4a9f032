// The scenes, cameras, photos and engines of the tests of what every device must do.
#ifndef TESTS_ENGINES_H
#define TESTS_ENGINES_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"
#include "base/rng.h"
#include "engine/engine.h"
#include "model/settings.h"

enum { W = 26, H = 37, N = 14 };

static const char *const devices[] = {"cpu", "reference"};
#define FOR_DEVICES(d) for (int d = 0; d < (int)(sizeof devices / sizeof *devices); d++)

// ---- scenes ----

typedef struct Kind {
    Separation separation;
    bool shared, pane, mirrored, covers, veil;
} Kind;

static const Kind kinds[] = {
    {SEPARATION_FULL, true, true, true},
    {SEPARATION_FULL, true, false, true},
    {SEPARATION_FULL, false, true, true},
    {SEPARATION_FULL, false, false, true},
    {SEPARATION_LINEAR, true, true, true},
    {SEPARATION_LINEAR, true, false, true},
    {SEPARATION_FLASHLESS, true, true, true},
    {SEPARATION_NONE, true, true, false},
    {SEPARATION_FULL, true, true, false},
    {SEPARATION_FULL, true, true, true, .covers = true},
    {SEPARATION_FULL, true, true, true, .veil = true},
};
#define FOR_KINDS(k) for (int k = 0; k < (int)(sizeof kinds / sizeof *kinds); k++)

static const Kind *const veiled = &kinds[sizeof kinds / sizeof *kinds - 1];

// Standard deviation over depth. The slopes are looked at on wide Gaussians, whose edge, where they stop at 1/255 and
// which no gradient knows of, is mostly outside the image.
static float wide = 0.12f;

static inline void fill(Cloud *cloud, int n, int channels, int gains, float depth, Rng *rng)
{
    assert_int_equal(fs_cloud_new(cloud, n, channels, gains, NULL), 0);
    for (int i = 0; i < n; i++) {
        float z = depth + 0.4f * fs_rng_uniform(rng);
        for (int k = 0; k < 2; k++) cloud->field[CLOUD_MEANS][3 * i + k] = 0.7f * z * (fs_rng_uniform(rng) - 0.5f);
        cloud->field[CLOUD_MEANS][3 * i + 2] = z;
        for (int k = 0; k < 3; k++)
            cloud->field[CLOUD_SCALES][3 * i + k] = logf(wide * depth) + 0.5f * fs_rng_uniform(rng);
        for (int k = 0; k < 4; k++) cloud->field[CLOUD_QUATS][4 * i + k] = fs_rng_normal(rng);
        cloud->field[CLOUD_OPACITIES][i] = -1.2f + fs_rng_uniform(rng);
        for (int k = 0; k < channels; k++)
            cloud->field[CLOUD_COLORS][channels * i + k] =
                channels == 1 ? fs_rng_normal(rng) : 0.4f + 0.5f * fs_rng_uniform(rng);
        if (gains) cloud->field[CLOUD_GAINS][i] = 0.5f * fs_rng_normal(rng) - 0.1f;
    }
}

// On most of what make_camera() sees, between it and the clouds.
static inline void make_veil(Veil *veil, Rng *rng)
{
    *veil = (Veil){.origin = {-0.35, -0.45, 1},
                   .right = {1, 0, 0},
                   .down = {0, 1, 0},
                   .cell = 0.07,
                   .distance = 0.9,
                   .unit = 0.01,
                   .ambient = {0.2, 0.3, 0.1}};
    assert_int_equal(fs_image_new(&veil->light, 11, 15, 1, NULL), 0);
    for (size_t i = 0; i < fs_image_values(&veil->light); i++) veil->light.px[i] = 0.02f + 0.2f * fs_rng_uniform(rng);
}

static inline Scene make_scene(const Kind *kind)
{
    Rng rng = fs_rng_new(5);
    Scene s = {.separation = kind->separation,
               .shared_geometry = kind->shared,
               .pane_beta = kind->pane,
               .pane = {{0.5, 0.1, -0.86}, 0.12, 0.08},
               .gain_color = {1.4, 1.2, 0.9},
               .flash_distance = 2.1,
               .extent = 0.5,
               .flash_return = 0.8,
               .vignetting = {-0.05, 0.02, -0.04},
               .response = {0, 0.01, -0.01, 0.005, -0.02, 0.01, 0, 0.01, 0.02, -0.01, 0.01}};
    double length = sqrt(0.25 + 0.01 + 0.86 * 0.86);
    for (int k = 0; k < 3; k++) s.pane.normal[k] /= length;
    fill(&s.cloud[LAYER_T_N], N, 3, kind->shared, 2, &rng);
    assert_int_equal(fs_cloud_covers(&s.cloud[LAYER_T_N], kind->covers, NULL), 0);
    for (int i = 0; i < N && kind->covers; i++)
        s.cloud[LAYER_T_N].field[CLOUD_COVERS][i] = 0.1f + 0.6f * fs_rng_uniform(&rng);
    if (!kind->shared) fill(&s.cloud[LAYER_T_F], N + 3, 3, 0, 2, &rng);
    if (kind->mirrored) fill(&s.cloud[LAYER_R], N - 2, 3, 0, 3.5f, &rng);
    if (kind->veil) make_veil(&s.veil, &rng);
    if (!kind->pane) fill(&s.cloud[LAYER_BETA], N - 1, 1, 0, 2, &rng);
    return s;
}

static inline Camera make_camera(void)
{
    const double a = 0.15, c = cos(a), s = sin(a);
    return (Camera){W, H, 30, 31, 12.4, 19.1, {c, 0, s, -0.2, 0, 1, 0, 0.05, -s, 0, c, 0.1}};
}

// ---- engines ----

static inline Engine *open_engine(const char *device, const Scene *scene)
{
    Engine *engine;
    assert_int_equal(fs_engine_new(&engine, device, "best", 2, NULL), 0);
    assert_string_equal(fs_engine_device(engine), device);
    if (scene) assert_int_equal(fs_engine_scene_up(engine, scene, NULL), 0);
    return engine;
}

static const PhotoState unlike = {.x = {0.1f, -0.15f, 0.2f, 0.05f, -0.07f, 0.02f}}; // the other photos

static inline void load_photo_with(Engine *engine, const Camera *camera, bool flash, const PhotoState *light)
{
    Image photo = {0}, mask = {0};
    Rng rng = fs_rng_new(77 + flash);
    assert_int_equal(fs_image_new(&photo, W, H, 3, NULL), 0);
    assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
    for (int i = 0; i < W * H * 3; i++) photo.px[i] = 0.4f * fs_rng_uniform(&rng) * (flash ? 2 : 1);
    for (int i = 0; i < W * H; i++) { // masked pixels far above or below what is rendered, so that they keep their say
        mask.px[i] = i % 11 != 0;
        for (int c = 0; c < 3 && i % 11 == 0; c++) photo.px[3 * i + c] = i % 2 ? 3 : 0;
    }
    assert_int_equal(fs_engine_load_view(engine, &(EngineView){camera, flash, &photo, &mask, *light}, NULL), 0);
    fs_image_free(&photo);
    fs_image_free(&mask);
}
static inline void load_photo(Engine *engine, const Camera *camera, bool flash)
{
    load_photo_with(engine, camera, flash, &unlike);
}

static inline void send_neighbours(Engine *engine, const Cloud *cloud)
{
    int list[(N + 3) * ENGINE_NEIGHBOURS];
    for (int i = 0; i < cloud->n; i++) { // the first eight others, in a made-up order of places
        Ranked at[N + 3];
        for (int j = 0; j < cloud->n; j++) {
            float apart = fabsf(cloud->field[CLOUD_MEANS][3 * i] - cloud->field[CLOUD_MEANS][3 * j]);
            at[j] = (Ranked){j == i ? INFINITY : (double)apart, j};
        }
        fs_order_ranked(at, (size_t)cloud->n);
        for (int k = 0; k < ENGINE_NEIGHBOURS; k++) list[i * ENGINE_NEIGHBOURS + k] = at[k].index;
    }
    assert_int_equal(fs_engine_neighbours(engine, list, NULL), 0);
}

// All terms, at a late step; rates too small to move anything.
static int sparse[2] = {1, 1}; // StepArgs.stride

static inline StepArgs make_args(const Scene *scene)
{
    FsSettings *set = fs_settings_new();
    assert_non_null(set);
    const char *const weights[][2] = {{"rgb-weight", "1.3"},      {"dssim", "0.3"},       {"contrast", "0.2"},
                                      {"linearity", "0.2"},       {"beta-smooth", "0.4"}, {"depth-smooth", "0.3"},
                                      {"gain-smooth", "0.2"},     {"opacity-reg", "0.2"}, {"scale-reg", "0.1"},
                                      {"gain-push", "0.3"},       {"opaque", "0.5"},      {"photo-reg", "0.2"},
                                      {"response-smooth", "0.5"}, {"unseen", "0"}}; // aims at what it moves
    for (size_t i = 0; i < sizeof weights / sizeof *weights; i++)
        assert_int_equal(fs_settings_set(set, weights[i][0], weights[i][1], NULL), 0);
    StepArgs args = {.step = 0, .stride = {sparse[0], sparse[1]}, .statistics = true, .settle = 1e-12};
    args.veil_rate = 1e-12;
    args.learn = LEARN_LIGHT | LEARN_WHITE | LEARN_VIGNETTING | LEARN_RESPONSE;
    args.veil_ambient = true;
    fs_loss_weights(set, scene, 1, args.weight);
    if (scene->cloud[LAYER_R].n) args.weight[LOSS_MIRRORED_LIGHT] = 0.3; // of scenes that do without gain-push
    for (int f = 0; f < CLOUD_FIELDS; f++) args.rate[f] = 1e-12;
    if (scene->separation != SEPARATION_FULL) args.rate[CLOUD_GAINS] = 0;
    if (scene->cloud[LAYER_T_N].width[CLOUD_COVERS]) args.weight[LOSS_DEPTH_SMOOTH] = 0; // one of the two is looked at
    fs_settings_free(set);
    return args;
}

#endif

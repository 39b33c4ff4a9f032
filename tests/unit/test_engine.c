// What every device must do: one suite, run on each. Renders against a renderer written here in double, gradients of
// the whole step against finite differences through the seam, edits, states, and arguments that are refused.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "engine/engine.h"
#include "kernels/pane.h"
#include "kernels/shade.h"
#include "model/settings.h"
#include "drawn.h"

enum { W = 26, H = 37, N = 14 };
_Static_assert(N + 3 <= DRAWN_MOST, "drawn.h takes no more Gaussians");

static const char *const devices[] = {"cpu", "reference"};
#define FOR_DEVICES(d) for (int d = 0; d < (int)(sizeof devices / sizeof *devices); d++)

// ---- scenes ----

typedef struct Kind {
    Separation separation;
    bool shared, pane, mirrored;
} Kind;

static const Kind kinds[] = {
    {SEPARATION_FULL, true, true, true},   {SEPARATION_FULL, true, false, true},
    {SEPARATION_FULL, false, true, true},  {SEPARATION_FULL, false, false, true},
    {SEPARATION_LINEAR, true, true, true}, {SEPARATION_FLASHLESS, true, true, true},
    {SEPARATION_NONE, true, true, false},  {SEPARATION_FULL, true, true, false},
};
#define FOR_KINDS(k) for (int k = 0; k < (int)(sizeof kinds / sizeof *kinds); k++)

// Standard deviation over depth. The slopes are looked at on wide Gaussians, whose edge, where they stop at 1/255 and
// which no gradient knows of, is mostly outside the image.
static float wide = 0.12f;

static void fill(Cloud *cloud, int n, int channels, int gains, float depth, Rng *rng)
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

static Scene make_scene(const Kind *kind)
{
    Rng rng = fs_rng_new(5);
    Scene s = {.separation = kind->separation,
               .shared_geometry = kind->shared,
               .pane_beta = kind->pane,
               .pane = {{0.5, 0.1, -0.86}, 0.12, 0.08},
               .gain_color = {1.4, 1.2, 0.9},
               .flash_distance = 2.1,
               .extent = 0.5,
               .flash_return = 0.2,
               .vignetting = {-0.05, 0.02, -0.04},
               .response = {0, 0.01, -0.01, 0.005, -0.02, 0.01, 0, 0.01, 0.02, -0.01, 0.01}};
    double length = sqrt(0.25 + 0.01 + 0.86 * 0.86);
    for (int k = 0; k < 3; k++) s.pane.normal[k] /= length;
    fill(&s.cloud[LAYER_T_N], N, 3, kind->shared, 2, &rng);
    if (!kind->shared) fill(&s.cloud[LAYER_T_F], N + 3, 3, 0, 2, &rng);
    if (kind->mirrored) fill(&s.cloud[LAYER_R], N - 2, 3, 0, 3.5f, &rng);
    if (!kind->pane) fill(&s.cloud[LAYER_BETA], N - 1, 1, 0, 2, &rng);
    return s;
}

static Camera make_camera(void)
{
    const double a = 0.15, c = cos(a), s = sin(a);
    return (Camera){W, H, 30, 31, 12.4, 19.1, {c, 0, s, -0.2, 0, 1, 0, 0.05, -s, 0, c, 0.1}};
}

// ---- engines ----

static Engine *open_engine(const char *device, const Scene *scene)
{
    Engine *engine;
    assert_int_equal(fs_engine_new(&engine, device, "best", 2, NULL), 0);
    assert_string_equal(fs_engine_device(engine), device);
    if (scene) assert_int_equal(fs_engine_scene_up(engine, scene, NULL), 0);
    return engine;
}

static const PhotoState unlike = {.x = {0.1f, -0.15f, 0.2f, 0.05f, -0.07f, 0.02f}}; // the other photos

static void load_photo_with(Engine *engine, const Camera *camera, bool flash, const PhotoState *light)
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
static void load_photo(Engine *engine, const Camera *camera, bool flash)
{
    load_photo_with(engine, camera, flash, &unlike);
}

static int compare_places(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void send_neighbours(Engine *engine, const Cloud *cloud)
{
    int list[(N + 3) * ENGINE_NEIGHBOURS];
    for (int i = 0; i < cloud->n; i++) { // the first eight others, in a made-up order of places
        float at[N + 3][2];
        for (int j = 0; j < cloud->n; j++) {
            at[j][0] = j == i ? INFINITY : fabsf(cloud->field[CLOUD_MEANS][3 * i] - cloud->field[CLOUD_MEANS][3 * j]);
            at[j][1] = (float)j;
        }
        qsort(at, (size_t)cloud->n, sizeof *at, compare_places);
        for (int k = 0; k < ENGINE_NEIGHBOURS; k++) list[i * ENGINE_NEIGHBOURS + k] = (int)at[k][1];
    }
    assert_int_equal(fs_engine_neighbours(engine, list, NULL), 0);
}

// All terms, at a late step; rates too small to move anything.
static StepArgs make_args(const Scene *scene)
{
    FsSettings *set = fs_settings_new();
    assert_non_null(set);
    const char *const weights[][2] = {{"rgb-weight", "1.3"},     {"dssim", "0.3"},       {"contrast", "0.2"},
                                      {"linearity", "0.2"},      {"beta-smooth", "0.4"}, {"depth-smooth", "0.3"},
                                      {"gain-smooth", "0.2"},    {"opacity-reg", "0.2"}, {"scale-reg", "0.1"},
                                      {"gain-push", "0.3"},      {"opaque", "0.5"},      {"photo-reg", "0.2"},
                                      {"response-smooth", "0.5"}};
    for (size_t i = 0; i < sizeof weights / sizeof *weights; i++)
        assert_int_equal(fs_settings_set(set, weights[i][0], weights[i][1], NULL), 0);
    StepArgs args = {.step = 0, .statistics = true, .settle = 1e-12};
    args.learn = LEARN_LIGHT | LEARN_WHITE | LEARN_VIGNETTING | LEARN_RESPONSE;
    fs_loss_weights(set, scene, 1, args.weight);
    for (int f = 0; f < CLOUD_FIELDS; f++) args.rate[f] = 1e-12;
    if (scene->separation != SEPARATION_FULL) args.rate[CLOUD_GAINS] = 0;
    fs_settings_free(set);
    return args;
}

// ---- renders ----

static void check_pixel(const Scene *s, const Camera *cam, const Renders *renders, int x, int y, int *depths)
{
    double want[RENDER_LAYERS][3];
    all_layers(s, cam, x, y, want);
    for (int l = 0; l < RENDER_LAYERS; l++) {
        const Image *image = &renders->layer[l];
        assert_true(image->width == W && image->height == H && image->channels == fs_render_layers[l].channels);
        for (int c = 0; c < image->channels; c++) {
            double got = image->px[(y * W + x) * image->channels + c], expected = want[l][c];
            if (fs_render_layers[l].depth && (got == 0) != (expected == 0)) continue; // half covered, but for rounding
            *depths += fs_render_layers[l].depth && got > 0;
            if (fabs(got - expected) > 2e-3 * fabs(expected) + 2e-4)
                print_message("%s at %d %d: %g, expected %g\n", fs_render_layers[l].name, x, y, got, expected);
            assert_true(fabs(got - expected) <= 2e-3 * fabs(expected) + 2e-4);
        }
    }
}

static void test_renders(void **state)
{
    (void)state;
    const Camera camera = make_camera();
    FOR_KINDS(k)
    {
        Scene scene = make_scene(&kinds[k]);
        FOR_DEVICES(d)
        {
            Engine *engine = open_engine(devices[d], &scene);
            Renders renders = {0};
            int depths = 0;
            assert_int_equal(fs_engine_render(engine, &camera, &renders, NULL), 0);
            for (int y = 0; y < H; y += 3)
                for (int x = 0; x < W; x++) check_pixel(&scene, &camera, &renders, x, y, &depths);
            assert_true(depths > 50);
            fs_engine_renders_free(&renders);
            fs_engine_free(engine);
        }
        fs_scene_free(&scene);
    }
}

// ---- gradients of a whole step ----

static double loss_of(const char *device, const Scene *scene, bool flash, StepResult *result)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    double sum = 0;
    load_photo(engine, &camera, flash);
    if (scene->shared_geometry) send_neighbours(engine, &scene->cloud[LAYER_T_N]);
    assert_int_equal(fs_engine_step(engine, &args, result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result->loss[k];
    fs_engine_free(engine);
    return sum;
}

// One step from zero moments: the gradients are the first moments, times ten.
static void gradients_of(const char *device, const Scene *scene, bool flash, TrainState *state, StepResult *result)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    load_photo(engine, &camera, flash);
    if (scene->shared_geometry) send_neighbours(engine, &scene->cloud[LAYER_T_N]);
    assert_int_equal(fs_engine_step(engine, &args, result, NULL), 0);
    assert_int_equal(fs_engine_state_down(engine, state, NULL), 0);
    fs_engine_free(engine);
}

// Moves a field along u by h. Where T_N's cloud is stepped as (T_F, gain), so is it here.
static void move_field(Scene *scene, int layer, int field, const float *u, double h)
{
    Cloud *cloud = &scene->cloud[layer];
    const Camera camera = make_camera();
    bool enter = layer == LAYER_T_N && fs_scene_lit(scene) && scene->separation == SEPARATION_FULL;
    unsigned char all[N];
    float d_colors[3 * N] = {0}, d_gains[N] = {0};
    ShadeLight light = {.flash_distance = (float)scene->flash_distance};
    ShadeCloud shade = {cloud->field[CLOUD_MEANS], cloud->field[CLOUD_COLORS], cloud->field[CLOUD_GAINS]};
    double centre[3];
    fs_camera_centre(&camera, centre);
    for (int k = 0; k < 3; k++) light.centre[k] = (float)centre[k], light.tint[k] = (float)scene->gain_color[k];
    memset(all, 1, sizeof all);
    enter = enter && (field == CLOUD_COLORS || field == CLOUD_GAINS);
    if (enter) fs_shade_scalar.enter(&light, &shade, all, 0, cloud->n, &(ShadeGradients){d_colors, d_gains});
    for (int i = 0; i < cloud->n * cloud->width[field]; i++) cloud->field[field][i] += (float)(h * (double)u[i]);
    if (enter) fs_shade_scalar.leave(&light, &shade, all, 0, cloud->n);
}

static double slope_along(const char *device, const Kind *kind, bool flash, int layer, int field, const float *u)
{
    const double h = field == CLOUD_COLORS || field == CLOUD_GAINS ? 2e-3 : 4e-4;
    double value[2];
    StepResult result;
    for (int side = 0; side < 2; side++) {
        Scene scene = make_scene(kind);
        move_field(&scene, layer, field, u, side ? h : -h);
        value[side] = loss_of(device, &scene, flash, &result);
        fs_scene_free(&scene);
    }
    return (value[1] - value[0]) / (2 * h);
}

static int bad_slopes;

// Along the gradient itself, so that single-precision noise does not matter, and along a random direction.
static void check_field(const char *device, const Kind *kind, bool flash, int layer, int field, const Cloud *m)
{
    int n = m->n * m->width[field];
    float u[4 * (N + 3)];
    double norm = 0, along = 0;
    for (int i = 0; i < n; i++) norm += pow(10.0 * (double)m->field[field][i], 2);
    norm = sqrt(norm);
    assert_true(norm > 1e-6);
    Rng rng = fs_rng_new((uint64_t)(layer * 10 + field));
    for (int i = 0; i < n; i++) {
        u[i] = (float)(10.0 * (double)m->field[field][i] / norm) + 0.2f * fs_rng_normal(&rng) / sqrtf((float)n);
        along += 10.0 * (double)m->field[field][i] * (double)u[i];
    }
    double slope = slope_along(device, kind, flash, layer, field, u), noise = 3e-5; // of single precision
    if (fabs(slope - along) > 0.03 * norm + noise)
        print_message("%s, %s, %s of %s%s%s: gradient %g, differences %g\n", device, flash ? "flash" : "no flash",
                      fs_cloud_fields[field].name, fs_layers[layer].name, kind->shared ? ", shared" : "",
                      kind->pane ? ", pane" : "", along, slope);
    bad_slopes += !(fabs(slope - along) <= 0.03 * norm + noise);
}

static void check_kind(const char *device, const Kind *kind, bool flash)
{
    Scene scene = make_scene(kind);
    TrainState state = {0};
    StepResult result;
    gradients_of(device, &scene, flash, &state, &result);
    Layer T = flash && !kind->shared ? LAYER_T_F : LAYER_T_N, other = T == LAYER_T_N ? LAYER_T_F : LAYER_T_N;
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *m = &state.cloud[l].m;
        if (!scene.cloud[l].n) continue;
        assert_int_equal(result.visible[l], l == (int)other ? 0 : scene.cloud[l].n);
        for (int f = 0; f < CLOUD_FIELDS; f++) {
            if (!m->width[f]) continue;
            bool stepped = l != (int)other && (f != CLOUD_GAINS || scene.separation == SEPARATION_FULL);
            for (int i = 0; i < m->n * m->width[f] && !stepped; i++) assert_true(m->field[f][i] == 0);
            // The flash's falloff is left out of the gradient of means, on purpose (kernels/shade.h).
            bool falls_off = f == CLOUD_MEANS && flash && fs_scene_lit(&scene) && scene.separation == SEPARATION_FULL;
            if (stepped && !falls_off) check_field(device, kind, flash, l, f, m);
        }
    }
    fs_engine_state_free(&state);
    fs_scene_free(&scene);
}

static void test_gradients(void **state)
{
    (void)state;
    wide = 0.55f;
    FOR_DEVICES(d) FOR_KINDS(k) for (int flash = 0; flash < 2; flash++) check_kind(devices[d], &kinds[k], flash == 1);
    wide = 0.12f;
    assert_int_equal(bad_slopes, 0);
}

// The numbers of the whole scene: pane, colour of the gain, what comes back of the flash, vignetting, response.
enum { KNOT_0 = 8 + FS_OPTICS_VIGNETTING };
static double slope_of_number(const char *device, const Kind *kind, bool flash, int number, const double u[3])
{
    const double h = 2e-3;
    double value[2];
    StepResult result;
    for (int side = 0; side < 2; side++) {
        Scene s = make_scene(kind);
        double step = side ? h : -h;
        for (int k = 0; k < 3 && number == 0; k++) s.pane.normal[k] += step * u[k];
        if (number == 3) s.pane.dimming += step;
        if (number >= 4 && number < 7) s.gain_color[number - 4] *= exp(step);
        if (number == 7) s.flash_return *= exp(step);
        if (number >= 8 && number < KNOT_0) s.vignetting[number - 8] += step;
        if (number >= KNOT_0) s.response[number - KNOT_0] += step;
        value[side] = loss_of(device, &s, flash, &result);
        fs_scene_free(&s);
    }
    return (value[1] - value[0]) / (2 * h);
}

static void test_gradients_of_numbers(void **state)
{
    (void)state;
    const Kind *kind = &kinds[0];
    Scene scene = make_scene(kind);
    const double *n = scene.pane.normal, u[3] = {n[1], -n[0], 0}; // at right angles to the normal
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        TrainState train = {0};
        StepResult result;
        gradients_of(devices[d], &scene, flash == 1, &train, &result);
        for (int i = 0; i < ENGINE_NUMBERS; i++) {
            if (i == 1 || i == 2 || i == KNOT_0) continue; // the normal is looked at along u; the first knot stays
            double g = 10.0 * (double)train.m[i];
            if (i == 0) g = 10 * ((double)train.m[0] * u[0] + (double)train.m[1] * u[1]);
            bool learned = i < 4 || i >= 8 || flash;
            if (!learned) assert_true(g == 0);
            if (!learned) continue;
            double slope = slope_of_number(devices[d], kind, flash == 1, i, u);
            if (fabs(slope - g) > 0.03 * fabs(g) + 2e-5)
                print_message("%s, number %d: gradient %g, differences %g\n", devices[d], i, g, slope);
            assert_true(fabs(slope - g) <= 0.03 * fabs(g) + 2e-5 && (g != 0 || i >= KNOT_0));
        }
        fs_engine_state_free(&train);
    }
    fs_scene_free(&scene);
}

// The numbers of the photo: its light and its white balance.
static double loss_of_photo(const char *device, const Scene *scene, bool flash, PhotoState *light)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    StepResult result;
    double sum = 0;
    load_photo_with(engine, &camera, flash, light);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result.loss[k];
    assert_int_equal(fs_engine_photos_down(engine, light, NULL), 0);
    fs_engine_free(engine);
    return sum;
}

static void test_gradients_of_photo(void **state)
{
    (void)state;
    const double h = 2e-3;
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        Scene scene = make_scene(&kinds[0]);
        PhotoState after = unlike;
        loss_of_photo(devices[d], &scene, flash == 1, &after);
        for (int i = 0; i < PHOTO_NUMBERS; i++) {
            double g = 10.0 * (double)after.m[i], value[2];
            if (i == PHOTO_FLASH && !flash) assert_true(g == 0);
            if (i == PHOTO_FLASH && !flash) continue;
            for (int side = 0; side < 2; side++) {
                PhotoState moved = unlike;
                moved.x[i] += (float)(side ? h : -h);
                value[side] = loss_of_photo(devices[d], &scene, flash == 1, &moved);
            }
            double slope = (value[1] - value[0]) / (2 * h);
            if (fabs(slope - g) > 0.03 * fabs(g) + 2e-5)
                print_message("%s, number %d of the photo: gradient %g, differences %g\n", devices[d], i, g, slope);
            assert_true(fabs(slope - g) <= 0.03 * fabs(g) + 2e-5);
        }
        assert_true(after.x[PHOTO_T] == 0 && fabsf(after.x[PHOTO_WHITE]) < 1e-6f); // the only photo is the mean
        fs_scene_free(&scene);
    }
}

// Who stands in the mirrored light's way: one step of a grid, at a loss without its cost.
static double loss_of_occlusion(const char *device, const Scene *scene, OcclusionState *occlusion, double settle)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    StepResult result;
    double sum = 0;
    args.settle = settle;
    load_photo(engine, &camera, false);
    assert_int_equal(fs_engine_occlusion_up(engine, 0, occlusion, NULL), 0);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result.loss[k];
    assert_int_equal(fs_engine_occlusion_down(engine, 0, occlusion, NULL), 0);
    fs_engine_free(engine);
    return sum;
}

static void test_gradients_of_occlusion(void **state)
{
    (void)state;
    Scene scene = make_scene(&kinds[0]);
    OcclusionState first[2];
    FOR_DEVICES(d)
    {
        static OcclusionState before, after, moved;
        double value[2], slope = 0, away = 0;
        const double h = 2e-2, settle = 1e-3;
        for (int i = 0; i < OCCLUSION_CELLS; i++)
            before.q[i] = 0.4f + 0.1f * sinf(0.01f * (float)i), before.cost[i] = 0;
        after = before;
        loss_of_occlusion(devices[d], &scene, &after, settle);
        for (int side = 0; side < 2; side++) {
            moved = before;
            for (int i = 0; i < OCCLUSION_CELLS; i++) moved.q[i] += (float)(side ? h : -h) * cosf(0.1f * (float)i);
            value[side] = loss_of_occlusion(devices[d], &scene, &moved, 0);
        }
        for (int i = 0; i < OCCLUSION_CELLS; i++) {
            double g = (double)(before.q[i] - after.q[i]) / settle; // in proportion to the gradient, with one factor
            slope += g * (double)cosf(0.1f * (float)i);
            away += fabs(g);
        }
        slope /= 2.0 * OCCLUSION_CELLS; // of the rate, and cells
        double differences = (value[1] - value[0]) / (2 * h);
        if (fabs(differences - slope) > 0.03 * fabs(slope) + 2e-5)
            print_message("%s: gradient %g, differences %g\n", devices[d], slope, differences);
        assert_true(fabs(differences - slope) <= 0.03 * fabs(slope) + 2e-5 && away > 0);
        for (int i = 0; i < OCCLUSION_CELLS; i++)
            after.cost[i] = i % 2 ? 1e3f : 0; // what costs much goes, and stays away
        loss_of_occlusion(devices[d], &scene, &after, settle);
        for (int i = 1; i < OCCLUSION_CELLS; i += 2) assert_true(after.q[i] == 0 && after.q[i - 1] > 0);
        first[d > 0] = after;
    }
    for (int i = 0; i < OCCLUSION_CELLS; i++) assert_true(fabsf(first[0].q[i] - first[1].q[i]) < 1e-3f);
    fs_scene_free(&scene);
}

static void test_occlusion_hides_R(void **state)
{
    (void)state;
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]), without = make_scene(&kinds[0]);
        static OcclusionState all;
        StepResult result;
        FsError err;
        for (int i = 0; i < OCCLUSION_CELLS; i++) all.q[i] = 1;
        for (int i = 0; i < 3 * without.cloud[LAYER_R].n; i++) without.cloud[LAYER_R].field[CLOUD_COLORS][i] = 0;
        const Camera camera = make_camera();
        double value[2] = {loss_of(devices[d], &without, false, &result), 0};
        value[0] = result.loss[LOSS_L1];
        Engine *engine = open_engine(devices[d], &scene);
        StepArgs args = make_args(&scene);
        load_photo(engine, &camera, false);
        assert_int_equal(fs_engine_occlusion_up(engine, 0, &all, NULL), 0);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        value[1] = result.loss[LOSS_L1];
        if (fabs(value[0] - value[1]) > 1e-5) print_message("%s: %g, black %g\n", devices[d], value[1], value[0]);
        assert_true(fabs(value[0] - value[1]) <= 1e-5);
        assert_int_equal(fs_engine_occlusion_up(engine, 0, NULL, NULL), 0);
        assert_int_equal(fs_engine_occlusion_down(engine, 0, &all, &err), FS_ERR_INPUT); // nobody
        assert_int_equal(fs_engine_occlusion_up(engine, 1, &all, &err), FS_ERR_INPUT);   // no such photo
        fs_engine_free(engine);
        fs_scene_free(&scene);
        fs_scene_free(&without);
    }
}

// ---- training ----

static StepArgs real_args(const Scene *scene, int step, int view)
{
    StepArgs args = make_args(scene);
    const double rate[CLOUD_FIELDS] = {1e-3, 5e-3, 1e-3, 5e-2, 5e-3, 1e-2};
    memcpy(args.rate, rate, sizeof rate);
    args.step = step;
    args.view = view;
    args.explore = 10;
    args.settle = 1;
    args.seed = 3;
    return args;
}

static double train(Engine *engine, const Scene *scene, int begin, int steps)
{
    StepResult result = {0};
    for (int i = begin; i < begin + steps; i++) {
        StepArgs args = real_args(scene, i, i % 2);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    }
    return result.loss[LOSS_L1];
}

static Engine *trainable_with(const char *device, int threads, const Scene *scene, const PhotoState light[2])
{
    const Camera camera = make_camera();
    Engine *engine;
    assert_int_equal(fs_engine_new(&engine, device, "best", threads, NULL), 0);
    assert_int_equal(fs_engine_scene_up(engine, scene, NULL), 0);
    load_photo_with(engine, &camera, false, &light[0]);
    load_photo_with(engine, &camera, true, &light[1]);
    return engine;
}
static Engine *trainable(const char *device, int threads, const Scene *scene)
{
    return trainable_with(device, threads, scene, (const PhotoState[2]){unlike, unlike});
}

static double cloud_distance(const Cloud *a, const Cloud *b)
{
    double most = 0;
    assert_int_equal(a->n, b->n);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < a->n * a->width[f]; i++)
            most = fmax(most, fabs((double)a->field[f][i] - (double)b->field[f][i]));
    return most;
}

static void test_devices_train_alike(void **state)
{
    (void)state;
    FOR_KINDS(k)
    {
        Scene scene = make_scene(&kinds[k]), after[3] = {0};
        const char *const device[3] = {"reference", "cpu", "cpu"};
        const int threads[3] = {1, 1, 3};
        double first = 0, last[3];
        for (int i = 0; i < 3; i++) {
            Engine *engine = trainable(device[i], threads[i], &scene);
            first = train(engine, &scene, 0, 1);
            last[i] = train(engine, &scene, 1, 39);
            assert_int_equal(fs_engine_scene_down(engine, (1u << LAYERS) - 1, &after[i], NULL), 0);
            fs_engine_free(engine);
        }
        assert_true(last[0] < 0.9 * first); // it learns
        for (int l = 0; l < LAYERS; l++) {
            assert_true(cloud_distance(&after[1].cloud[l], &after[2].cloud[l]) == 0);
            assert_true(cloud_distance(&after[0].cloud[l], &after[1].cloud[l]) < 0.1);
            if (scene.cloud[l].n) assert_true(cloud_distance(&scene.cloud[l], &after[1].cloud[l]) > 1e-3);
        }
        assert_true(fabs(last[0] - last[1]) < 0.01 * last[0]);
        for (int i = 0; i < 3; i++) fs_scene_free(&after[i]);
        fs_scene_free(&scene);
    }
}

// Scene and state, taken down amid a training and put up elsewhere, go on to the same bits.
static void test_state_goes_on(void **state)
{
    (void)state;
    FOR_DEVICES(d) FOR_KINDS(k)
    {
        Scene scene = make_scene(&kinds[k]), half = {0}, whole = {0}, resumed = {0};
        TrainState kept = {0};
        PhotoState light[2], end[2][2];
        Engine *engine = trainable(devices[d], 2, &scene), *second;
        if (scene.shared_geometry) send_neighbours(engine, &scene.cloud[LAYER_T_N]);
        train(engine, &scene, 0, 6);
        assert_int_equal(fs_engine_scene_down(engine, (1u << LAYERS) - 1, &half, NULL), 0);
        assert_int_equal(fs_engine_state_down(engine, &kept, NULL), 0);
        assert_int_equal(fs_engine_photos_down(engine, light, NULL), 0);
        train(engine, &scene, 6, 6);
        assert_int_equal(fs_engine_scene_down(engine, (1u << LAYERS) - 1, &whole, NULL), 0);
        second = trainable_with(devices[d], 1, &half, light);
        assert_int_equal(fs_engine_state_up(second, &kept, NULL), 0);
        if (scene.shared_geometry) send_neighbours(second, &scene.cloud[LAYER_T_N]);
        train(second, &half, 6, 6);
        assert_int_equal(fs_engine_scene_down(second, (1u << LAYERS) - 1, &resumed, NULL), 0);
        for (int l = 0; l < LAYERS; l++) assert_true(cloud_distance(&whole.cloud[l], &resumed.cloud[l]) == 0);
        assert_memory_equal(&whole.pane, &resumed.pane, sizeof whole.pane);
        assert_memory_equal(whole.gain_color, resumed.gain_color, sizeof whole.gain_color);
        assert_true(whole.flash_return == resumed.flash_return);
        assert_memory_equal(whole.vignetting, resumed.vignetting, sizeof whole.vignetting);
        assert_memory_equal(whole.response, resumed.response, sizeof whole.response);
        assert_int_equal(fs_engine_photos_down(engine, end[0], NULL), 0);
        assert_int_equal(fs_engine_photos_down(second, end[1], NULL), 0);
        assert_memory_equal(end[0], end[1], sizeof end[0]);
        fs_engine_free(engine);
        fs_engine_free(second);
        fs_engine_state_free(&kept);
        fs_scene_free(&scene), fs_scene_free(&half), fs_scene_free(&whole), fs_scene_free(&resumed);
    }
}

static void test_scene_down_in_parts(void **state)
{
    (void)state;
    Scene scene = make_scene(&kinds[2]), part = {0};
    FOR_DEVICES(d)
    {
        Engine *engine = open_engine(devices[d], &scene);
        assert_int_equal(fs_engine_scene_down(engine, 1u << LAYER_R, &part, NULL), 0);
        assert_true(cloud_distance(&part.cloud[LAYER_R], &scene.cloud[LAYER_R]) == 0);
        assert_int_equal(part.cloud[LAYER_T_N].n, 0);
        assert_true(part.flash_return == scene.flash_return && part.pane.f0 == scene.pane.f0);
        fs_scene_free(&part);
        fs_engine_free(engine);
    }
    fs_scene_free(&scene);
}

// ---- edits ----

static void test_edit(void **state)
{
    (void)state;
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]), down = {0};
        TrainState before = {0}, after = {0};
        Engine *engine = trainable(devices[d], 2, &scene);
        train(engine, &scene, 0, 3);
        assert_int_equal(fs_engine_state_down(engine, &before, NULL), 0);
        for (int i = 0; i < N - 2; i++) assert_true(before.cloud[LAYER_R].screen[2 * i + 1] == 3);
        assert_true(before.cloud[LAYER_R].screen[0] > 0);
        int from[N] = {3, -1, 0, 0, 5, 5, 5, -1, 1, 2, 4, 4, 4, 4};
        Cloud fresh = {0};
        Rng rng = fs_rng_new(9);
        fill(&fresh, N, 3, 0, 3, &rng);
        CloudEdit edit = {LAYER_R, &fresh, from, 1u << CLOUD_OPACITIES};
        assert_int_equal(fs_engine_edit(engine, &edit, NULL), 0);
        assert_int_equal(fs_engine_scene_down(engine, 1u << LAYER_R, &down, NULL), 0);
        assert_true(cloud_distance(&fresh, &down.cloud[LAYER_R]) == 0);
        assert_int_equal(fs_engine_state_down(engine, &after, NULL), 0);
        for (int i = 0; i < N; i++) {
            const float *m = after.cloud[LAYER_R].m.field[CLOUD_QUATS],
                        *old = before.cloud[LAYER_R].m.field[CLOUD_QUATS];
            for (int k = 0; k < 4; k++) assert_true(m[4 * i + k] == (from[i] < 0 ? 0 : old[4 * from[i] + k]));
            assert_true(after.cloud[LAYER_R].v.field[CLOUD_OPACITIES][i] == 0);
            assert_true(after.cloud[LAYER_R].screen[2 * i + 1] == 0);
        }
        assert_true(cloud_distance(&before.cloud[LAYER_T_N].m, &after.cloud[LAYER_T_N].m) == 0);
        train(engine, &scene, 3, 2);
        fs_cloud_free(&fresh);
        fs_engine_state_free(&before), fs_engine_state_free(&after);
        fs_scene_free(&scene), fs_scene_free(&down);
        fs_engine_free(engine);
    }
}

// ---- what is refused ----

static void refused(int rc, const FsError *err)
{
    assert_int_equal(rc, FS_ERR_INPUT);
    assert_non_null(strstr(err->message, "engine: "));
}

static void test_refused(void **state)
{
    (void)state;
    FsError err;
    Engine *engine;
    assert_int_equal(fs_engine_new(&engine, "abacus", "best", 1, &err), FS_ERR_USAGE);
    assert_null(engine);
    fs_engine_free(engine);
    assert_int_equal(fs_engine_new(&engine, "cpu", "z80", 1, &err), FS_ERR_USAGE);
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]), wrong = make_scene(&kinds[0]), apart = make_scene(&kinds[3]), down = {0};
        TrainState kept = {0};
        StepArgs args = make_args(&scene);
        StepResult result;
        Renders renders = {0};
        const Camera camera = make_camera();
        engine = open_engine(devices[d], NULL);
        refused(fs_engine_render(engine, &camera, &renders, &err), &err);
        refused(fs_engine_step(engine, &args, &result, &err), &err);
        refused(fs_engine_scene_down(engine, 1, &down, &err), &err);
        refused(fs_engine_state_down(engine, &kept, &err), &err);
        refused(fs_engine_state_up(engine, &kept, &err), &err);
        wrong.pane_beta = false; // fine: there is no beta cloud
        assert_int_equal(fs_engine_scene_up(engine, &wrong, &err), 0);
        apart.pane_beta = true; // a beta cloud, though the pane says
        refused(fs_engine_scene_up(engine, &apart, &err), &err);
        apart.pane_beta = false;
        apart.shared_geometry = true;
        refused(fs_engine_scene_up(engine, &apart, &err), &err);
        assert_int_equal(fs_engine_scene_up(engine, &scene, &err), 0);
        refused(fs_engine_state_up(engine, &kept, &err), &err);      // of nothing
        refused(fs_engine_step(engine, &args, &result, &err), &err); // no photo
        int from[N] = {0}, list[N * ENGINE_NEIGHBOURS] = {0};
        from[4] = N;
        refused(fs_engine_edit(engine, &(CloudEdit){LAYER_T_N, &scene.cloud[LAYER_T_N], from, 0}, &err), &err);
        from[4] = 0;
        refused(fs_engine_edit(engine, &(CloudEdit){LAYER_T_N, &scene.cloud[LAYER_R], from, 0}, &err), &err);
        refused(fs_engine_edit(engine, &(CloudEdit){LAYER_BETA, &scene.cloud[LAYER_R], from, 0}, &err), &err);
        list[9] = -1;
        refused(fs_engine_neighbours(engine, list, &err), &err);
        Image photo = {0}, mask = {0};
        assert_int_equal(fs_image_new(&photo, W + 1, H, 3, NULL), 0);
        assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
        refused(fs_engine_load_view(engine, &(EngineView){&camera, true, &photo, &mask, unlike}, &err), &err);
        fs_image_free(&photo);
        fs_image_free(&mask);
        load_photo(engine, &camera, true);
        assert_int_equal(fs_engine_step(engine, &args, &result, &err), 0);
        fs_engine_drop_views(engine); // and it is gone
        refused(fs_engine_step(engine, &args, &result, &err), &err);
        fs_cloud_free(&scene.cloud[LAYER_T_N]); // and a scene without what is behind the pane
        assert_int_equal(fs_engine_scene_up(engine, &scene, &err), 0);
        load_photo(engine, &camera, true);
        assert_int_equal(fs_engine_step(engine, &args, &result, &err), FS_ERR_INPUT);
        fs_engine_free(engine);
        fs_scene_free(&scene), fs_scene_free(&wrong), fs_scene_free(&apart), fs_scene_free(&down);
    }
}

// What is behind the camera, and clouds that are empty, leave black.
static void test_nothing_in_view(void **state)
{
    (void)state;
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[3]);
        Camera camera = make_camera();
        camera.w2c[11] = -50;
        Engine *engine = open_engine(devices[d], &scene);
        Renders renders = {0};
        StepResult result;
        StepArgs args = make_args(&scene);
        load_photo(engine, &camera, false);
        assert_int_equal(fs_engine_render(engine, &camera, &renders, NULL), 0);
        for (int i = 0; i < W * H; i++) assert_true(renders.layer[RENDER_I_F].px[3 * i] == 0);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        assert_int_equal(result.visible[LAYER_T_N], 0);
        fs_engine_renders_free(&renders);
        fs_engine_free(engine);
        fs_scene_free(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_renders),
        cmocka_unit_test(test_gradients),
        cmocka_unit_test(test_gradients_of_numbers),
        cmocka_unit_test(test_gradients_of_photo),
        cmocka_unit_test(test_gradients_of_occlusion),
        cmocka_unit_test(test_occlusion_hides_R),
        cmocka_unit_test(test_devices_train_alike),
        cmocka_unit_test(test_state_goes_on),
        cmocka_unit_test(test_scene_down_in_parts),
        cmocka_unit_test(test_edit),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_nothing_in_view),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

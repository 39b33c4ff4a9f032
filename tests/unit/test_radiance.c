// Scenes of radiance fields through the engine's seam, on every device: gradients of the whole step against finite
// differences, devices against each other, threads, states that go on to the same bits; and their files.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "engine/engine.h"
#include "model/settings.h"
#include "temp_dir.h"

enum { W = 13, H = 9 };

static const char *const devices[] = {"cpu", "reference"};
#define FOR_DEVICES(d) for (int d = 0; d < 2; d++)
static const Separation kinds[] = {SEPARATION_NONE, SEPARATION_FLASHLESS, SEPARATION_FULL};
#define FOR_KINDS(k) for (int k = 0; k < 3; k++)

static const RadianceFrame frame = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {-0.5, -0.4}, {0.6, 0.5}, 1, 8, 0.8};

static Scene make_scene(Separation kind)
{
    Scene s = {
        .separation = kind, .shared_geometry = true, .gain_color = {1, 1, 1}, .flash_distance = 1, .extent = 0.5};
    RadianceShape shape = {
        .levels = 4, .log2_rows = 7, .coarsest = 2, .finest = 9, .hidden = 8, .grid = 5, .samples = 12};
    shape.colors[VOLUME_T] = kind == SEPARATION_FULL ? 6 : 3;
    shape.colors[VOLUME_R] = kind == SEPARATION_NONE ? 0 : 3;
    assert_int_equal(fs_radiance_new(&s.field, &shape, &frame, 3, NULL), 0);
    Rng rng = fs_rng_new(8);
    for (int v = 0; v < VOLUMES; v++) {
        size_t n, at = fs_radiance_at(&shape, (Volume)v, RADIANCE_TABLE, &n);
        for (size_t i = 0; i < n; i++) s.field.x[at + i] = fs_rng_normal(&rng);
        at = fs_radiance_at(&shape, (Volume)v, RADIANCE_BODY, &n);
        for (size_t i = 0; i < n && i < 8; i++)
            s.field.x[at + i] = 1.2f * fabsf(s.field.x[at + i]); // not all of it thin
        at = fs_radiance_at(&shape, (Volume)v, RADIANCE_COLOR_1, &n);
        for (size_t i = 0; i < n; i++) s.field.x[at + i] += 0.3f * fs_rng_normal(&rng);
        at = fs_radiance_at(&shape, (Volume)v, RADIANCE_GRID, &n);
        for (size_t i = 0; i < n; i += 9) s.field.x[at + i] = 0; // some cells are empty
    }
    return s;
}

static Engine *open_engine(const char *device, const Scene *scene, int threads)
{
    Engine *engine;
    assert_int_equal(fs_engine_new(&engine, device, "best", threads, NULL), 0);
    assert_int_equal(fs_engine_scene_up(engine, scene, NULL), 0);
    Image photo = {0}, mask = {0};
    const Camera camera = {W, H, 16, 15, 6.1, 4.7, {1, 0, 0, -0.1, 0, 1, 0, 0.05, 0, 0, 1, 0.1}};
    for (int flash = 0; flash < 2; flash++) {
        Rng rng = fs_rng_new(77 + (uint64_t)flash);
        assert_int_equal(fs_image_new(&photo, W, H, 3, NULL), 0);
        assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
        for (int i = 0; i < W * H * 3; i++) photo.px[i] = 0.4f * fs_rng_uniform(&rng);
        for (int i = 0; i < W * H; i++) mask.px[i] = 1;
        assert_int_equal(fs_engine_load_view(engine, &(EngineView){&camera, flash == 1, &photo, &mask}, NULL), 0);
        fs_image_free(&photo);
        fs_image_free(&mask);
    }
    return engine;
}

// All terms; `rate` of Adam.
static StepArgs make_args(const Scene *scene, bool flash, double rate)
{
    FsSettings *set = fs_settings_new();
    assert_non_null(set);
    static const char *const weights[][2] = {{"rgb-weight", "1.3"}, {"linearity", "0.2"},  {"depth-smooth", "0.3"},
                                             {"opaque", "0.5"},     {"spread", "0.4"},     {"way-smooth", "0.7"},
                                             {"way-both", "0.6"},   {"beta-smooth", "0.3"}};
    for (size_t i = 0; i < sizeof weights / sizeof *weights; i++)
        assert_int_equal(fs_settings_set(set, weights[i][0], weights[i][1], NULL), 0);
    StepArgs args = {.view = flash, .field_rate = rate, .settle = 1, .seed = 1, .learn = LEARN_VIGNETTING};
    fs_loss_weights(set, scene, 0.7, args.weight);
    if (scene->separation != SEPARATION_NONE)
        args.weight[LOSS_WAY_BOTH] = 0.6; // which ends before the other terms begin
    fs_settings_free(set);
    return args;
}

static double loss_of(const char *device, const Scene *scene, bool flash, TrainState *state)
{
    Engine *engine = open_engine(device, scene, 2);
    StepArgs args = make_args(scene, flash, 1e-12);
    StepResult result;
    double sum = 0;
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result.loss[k];
    for (int k = 0; k < LOSS_TERMS; k++)
        if (args.weight[k] > 0 && k != LOSS_UNSEEN && k != LOSS_PHOTO_REG && k != LOSS_RESPONSE_SMOOTH)
            assert_true(result.loss[k] != 0);
    if (state) assert_int_equal(fs_engine_state_down(engine, state, NULL), 0);
    fs_engine_free(engine);
    return sum;
}

// ---- gradients ----

static int bad_slopes;

// Along the gradient and a random direction; the gradient is the first moment times ten.
static void check_part(const char *device, const Scene *scene, bool flash, Volume volume, RadiancePart part)
{
    TrainState state = {0};
    size_t n, at = fs_radiance_at(&scene->field.shape, volume, part, &n);
    double norm = 0, along = 0, value[2], *u = malloc(sizeof *u * n);
    assert_non_null(u);
    loss_of(device, scene, flash, &state);
    for (size_t i = 0; i < n; i++) norm += pow(10 * (double)state.field_m[at + i], 2);
    norm = sqrt(norm);
    assert_true(norm > 1e-7);
    Rng rng = fs_rng_new(volume * 10 + part);
    for (size_t i = 0; i < n; i++) {
        double g = 10 * (double)state.field_m[at + i];
        u[i] = g / norm + 0.2 * (double)fs_rng_normal(&rng) / sqrt((double)n);
        along += g * u[i];
    }
    const double h = 2e-3;
    for (int side = 0; side < 2; side++) {
        Scene moved;
        assert_int_equal(fs_scene_copy(&moved, scene, NULL), 0);
        for (size_t i = 0; i < n; i++) moved.field.x[at + i] += (float)((side ? h : -h) * u[i]);
        value[side] = loss_of(device, &moved, flash, NULL);
        fs_scene_free(&moved);
    }
    double slope = (value[1] - value[0]) / (2 * h);
    if (fabs(slope - along) > 0.04 * norm + 1e-4)
        print_message("%s, %s, %s of volume %d: gradient %g, differences %g\n", device,
                      fs_scene_separations[scene->separation], fs_radiance_parts[part].name, volume, along, slope);
    bad_slopes += !(fabs(slope - along) <= 0.04 * norm + 1e-4);
    fs_engine_state_free(&state);
    free(u);
}

static void test_gradients(void **state)
{
    (void)state;
    FOR_DEVICES(d) FOR_KINDS(k)
    {
        Scene scene = make_scene(kinds[k]);
        for (int v = 0; v < VOLUMES; v++)
            for (int p = 0; p < RADIANCE_LEARNED && scene.field.shape.colors[v]; p++)
                check_part(devices[d], &scene, k == 1, (Volume)v, (RadiancePart)p);
        fs_scene_free(&scene);
    }
    assert_int_equal(bad_slopes, 0);
}

// ---- devices, threads, states ----

static void train(Engine *engine, const Scene *scene, int from, int to)
{
    StepResult result;
    for (int step = from; step < to; step++) {
        StepArgs args = make_args(scene, step % 2, 1e-2);
        args.step = step;
        args.every = step < 4 ? 4 : 1;
        args.blind = step < 8;
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    }
}

static void down(Engine *engine, Scene *scene)
{
    *scene = (Scene){0};
    assert_int_equal(fs_engine_scene_down(engine, 1, scene, NULL), 0);
}

static void test_threads(void **state)
{
    (void)state;
    Scene scene = make_scene(SEPARATION_FULL), first = {0}, now;
    for (int threads = 1; threads <= 3; threads++) {
        Engine *engine = open_engine("cpu", &scene, threads);
        train(engine, &scene, 0, 20);
        down(engine, &now);
        assert_memory_not_equal(now.field.x, scene.field.x, sizeof(float) * now.field.n);
        if (threads == 1)
            first = now;
        else {
            assert_memory_equal(now.field.x, first.field.x, sizeof(float) * now.field.n);
            fs_scene_free(&now);
        }
        fs_engine_free(engine);
    }
    fs_scene_free(&first);
    fs_scene_free(&scene);
}

static void test_goes_on(void **state)
{
    (void)state;
    Scene scene = make_scene(SEPARATION_FLASHLESS), half, end[2];
    TrainState train_state = {0};
    Engine *engine = open_engine("cpu", &scene, 2);
    train(engine, &scene, 0, 17); // past a look at the grid
    down(engine, &half);
    assert_int_equal(fs_engine_state_down(engine, &train_state, NULL), 0);
    train(engine, &scene, 17, 34);
    down(engine, &end[0]);
    fs_engine_free(engine);
    engine = open_engine("cpu", &half, 1);
    assert_int_equal(fs_engine_state_up(engine, &train_state, NULL), 0);
    train(engine, &scene, 17, 34);
    down(engine, &end[1]);
    assert_memory_equal(end[0].field.x, end[1].field.x, sizeof(float) * end[0].field.n);
    fs_engine_state_free(&train_state); // one without moments is not this scene's
    assert_int_not_equal(fs_engine_state_up(engine, &train_state, NULL), 0);
    fs_engine_free(engine);
    Scene *all[] = {&scene, &half, &end[0], &end[1]};
    for (int i = 0; i < 4; i++) fs_scene_free(all[i]);
}

static void test_devices_render_alike(void **state)
{
    (void)state;
    const Camera camera = {40, 31, 50, 50, 20, 15, {1, 0, 0, 0.05, 0, 1, 0, 0, 0, 0, 1, 0}};
    FOR_KINDS(k)
    {
        Scene scene = make_scene(kinds[k]);
        Renders renders[2] = {0};
        FOR_DEVICES(d)
        {
            Engine *engine = open_engine(devices[d], &scene, 2);
            assert_int_equal(fs_engine_render(engine, &camera, &renders[d], NULL), 0);
            fs_engine_free(engine);
        }
        double light[RENDER_LAYERS] = {0};
        for (int l = 0; l < RENDER_LAYERS; l++)
            for (size_t i = 0; i < fs_image_values(&renders[0].layer[l]); i++) {
                float a = renders[0].layer[l].px[i], b = renders[1].layer[l].px[i];
                if (!fs_render_layers[l].depth) assert_true(fabsf(a - b) <= 1e-4f + 1e-3f * fabsf(a));
                light[l] += (double)a;
            }
        for (int l = 0; l < RENDER_LAYERS; l++) {
            bool of_R = l == RENDER_R || l == RENDER_R_SCENE || l == RENDER_BETA || l == RENDER_DEPTH_R;
            assert_int_equal(light[l] > 0, !of_R || kinds[k] != SEPARATION_NONE);
        }
        assert_int_equal(light[RENDER_T_N] != light[RENDER_T_F], kinds[k] == SEPARATION_FULL);
        for (int d = 0; d < 2; d++) fs_engine_renders_free(&renders[d]);
        fs_scene_free(&scene);
    }
}

// ---- files ----

static void test_files(void **state)
{
    const char *dir = *state;
    FilePath field = fs_file_at("%s/s/field.bin", dir), out = fs_file_at("%s/s", dir);
    Scene scene = make_scene(SEPARATION_FULL), back;
    FsError err;
    char *data;
    size_t size;
    assert_int_equal(fs_scene_write(&scene, out.text, NULL), 0);
    assert_int_equal(fs_scene_read(&back, out.text, NULL), 0);
    assert_memory_equal(&back.field.shape, &scene.field.shape, sizeof scene.field.shape);
    assert_memory_equal(&back.field.frame, &scene.field.frame, sizeof scene.field.frame);
    assert_memory_equal(back.field.x, scene.field.x, sizeof(float) * scene.field.n);
    fs_scene_free(&back);
    assert_int_equal(fs_file_read(field.text, 1 << 24, &data, &size, NULL), 0);
    assert_int_equal(size, scene.field.n * sizeof(float));
    for (int k = 0; k < 3; k++) { // too short, too long, not a number
        char *wrong = calloc(1, size + 4);
        assert_non_null(wrong);
        memcpy(wrong, data, size);
        if (k == 2) ((float *)(void *)wrong)[5] = NAN;
        assert_int_equal(fs_file_write(field.text, wrong, k == 0 ? size - 4 : k == 1 ? size + 4 : size, NULL), 0);
        assert_int_not_equal(fs_scene_read(&back, out.text, &err), 0);
        assert_non_null(strstr(err.message, "field.bin"));
        free(wrong);
    }
    free(data);
    fs_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradients),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_goes_on),
        cmocka_unit_test(test_devices_render_alike),
        cmocka_unit_test_setup_teardown(test_files, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

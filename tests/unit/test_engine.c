// What every device must do: one suite, run on each. Renders against a renderer written here in double, training,
// states, edits, and arguments that are refused; test_engine_gradients.c has the gradients.
#include "engines.h"

#include "drawn.h"

_Static_assert(N + 3 <= DRAWN_MOST, "drawn.h takes no more Gaussians");

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
            if (fs_render_layers[l].depth && isnan(expected)) continue; // which Gaussian it is, rounding says
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

// ---- training ----

static StepArgs real_args(const Scene *scene, int step, int view)
{
    StepArgs args = make_args(scene);
    const double rate[CLOUD_FIELDS] = {1e-3, 5e-3, 1e-3, 5e-2, 5e-3, 1e-2};
    memcpy(args.rate, rate, sizeof rate);
    args.step = step;
    args.view = view;
    args.stride[1] = 1 + (step % 3 == 2); // now and then every second row
    args.veil_rate = 0.05;
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

// What the prior costs of a photo at the end of a row of ten whose light rises along the row, and jumps by so much.
static double cost_of_light(const char *device, const Scene *scene, double jumps)
{
    StepArgs args = make_args(scene);
    StepResult result = {0};
    Engine *engine = open_engine(device, scene);
    for (int i = 0; i < 10; i++) {
        const int up = (i + 1) / 2 % 2 ? -1 : 1; // goes along with nothing
        const PhotoState light = {.x = {[PHOTO_T] = (float)(0.02 * (i - 4.5) / 4.5 + jumps * up)}};
        Camera camera = make_camera();
        camera.w2c[3] += 0.5 * scene->extent * (i - 4.5);
        load_photo_with(engine, &camera, false, &light);
    }
    args.view = 9;
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    fs_engine_free(engine);
    return result.loss[LOSS_PHOTO_REG];
}

// A capture under one light has no light that rises along the photos' way; one whose light jumps may have.
static void test_light_that_goes_along_with_the_place(void **state)
{
    (void)state;
    Scene scene = make_scene(&kinds[0]);
    FOR_DEVICES(d)
    {
        double even = cost_of_light(devices[d], &scene, 0), uneven = cost_of_light(devices[d], &scene, 0.04);
        assert_true(even > 50 * 0.02 * 0.02);
        assert_true(uneven > 0.01 * 0.06 * 0.06 && uneven < 0.3 * 0.06 * 0.06);
    }
    fs_scene_free(&scene);
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
        size_t cells = fs_image_values(&whole.veil.light);
        assert_int_equal(cells, kinds[k].veil ? 11 * 15 : 0);
        assert_int_equal(cells, fs_image_values(&resumed.veil.light));
        if (cells) assert_memory_equal(whole.veil.light.px, resumed.veil.light.px, cells * sizeof(float));
        if (cells) assert_memory_not_equal(whole.veil.light.px, half.veil.light.px, cells * sizeof(float));
        assert_memory_equal(whole.veil.ambient, resumed.veil.ambient, sizeof whole.veil.ambient);
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
        Scene dirty = make_scene(veiled);
        dirty.separation = SEPARATION_NONE; // which the flash does not light
        refused(fs_engine_scene_up(engine, &dirty, &err), &err);
        fs_scene_free(&dirty);
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
        cmocka_unit_test(test_devices_train_alike),
        cmocka_unit_test(test_state_goes_on),
        cmocka_unit_test(test_light_that_goes_along_with_the_place),
        cmocka_unit_test(test_scene_down_in_parts),
        cmocka_unit_test(test_edit),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_nothing_in_view),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

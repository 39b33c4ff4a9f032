// What every device must do: what of a photo is unseen, left over or clipped, and how dark colours get.
#include "engines.h"
#include "model/dataset.h"

// Hidden in the left half of the photo, R becomes what it is in the right half, and nothing else is touched.
static void test_unseen_is_what_is_around(void **state)
{
    (void)state;
    double first[2];
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]), after = {0};
        static OcclusionState left;
        const Camera camera = make_camera();
        StepResult result;
        for (int i = 0; i < OCCLUSION_CELLS; i++) left.q[i] = i % OCCLUSION_WIDTH < OCCLUSION_WIDTH / 2;
        Engine *engine = open_engine(devices[d], &scene);
        StepArgs args = make_args(&scene);
        load_photo(engine, &camera, false);
        memset(args.weight, 0, sizeof args.weight);
        args.weight[LOSS_UNSEEN] = 1;
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        assert_true(result.loss[LOSS_UNSEEN] == 0); // nobody hides anything
        assert_int_equal(fs_engine_occlusion_up(engine, 0, &left, NULL), 0);
        for (args.step = 1; args.step < 150; args.step++) {
            args.rate[CLOUD_COLORS] = args.step > 1 ? 0.01 : 1e-12;
            assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
            if (args.step == 1) first[d] = result.loss[LOSS_UNSEEN];
        }
        assert_true(first[d] > 0.01 && result.loss[LOSS_UNSEEN] < 0.8 * first[d]);
        for (int i = 0; i < OCCLUSION_CELLS; i++) left.q[i] = 1; // there is nothing around that it could be
        assert_int_equal(fs_engine_occlusion_up(engine, 0, &left, NULL), 0);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        assert_true(result.loss[LOSS_UNSEEN] == 0);
        assert_int_equal(fs_engine_scene_down(engine, 1u << LAYER_T_N | 1u << LAYER_R, &after, NULL), 0);
        for (int i = 0; i < 3 * scene.cloud[LAYER_T_N].n; i++)
            assert_true(fabsf(after.cloud[LAYER_T_N].field[CLOUD_COLORS][i] -
                              scene.cloud[LAYER_T_N].field[CLOUD_COLORS][i]) < 1e-4f);
        fs_engine_free(engine);
        fs_scene_free(&scene);
        fs_scene_free(&after);
    }
    assert_true(fabs(first[0] - first[1]) < 1e-5);
}

// Of a photo that is brighter everywhere than its render, what it has beyond that is all of the loss; its pixels are
// fewer than cells.
static void test_residual(void **state)
{
    (void)state;
    static float residual[2][3 * OCCLUSION_CELLS];
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]);
        const Camera camera = make_camera();
        Image photo = {0}, mask = {0};
        StepResult result;
        double sum = 0;
        assert_int_equal(fs_image_new(&photo, W, H, 3, NULL), 0);
        assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
        for (int i = 0; i < W * H; i++) {
            mask.px[i] = 1;
            for (int c = 0; c < 3; c++) photo.px[3 * i + c] = 6 + (float)(i % 7);
        }
        Engine *engine = open_engine(devices[d], &scene);
        StepArgs args = make_args(&scene);
        args.weight[LOSS_DSSIM] = args.weight[LOSS_CONTRAST] = 0;
        args.residual = residual[d];
        const EngineView view = {&camera, false, &photo, &mask, unlike, 0, 0};
        assert_int_equal(fs_engine_load_view(engine, &view, NULL), 0);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        for (int i = 0; i < 3 * OCCLUSION_CELLS; i++) {
            assert_true(residual[d][i] >= 0);
            sum += (double)residual[d][i] / (3.0 * W * H);
        }
        assert_true(fabs(sum - result.loss[LOSS_L1]) < 1e-4 * sum);
        fs_engine_free(engine);
        fs_scene_free(&scene);
        fs_image_free(&photo);
        fs_image_free(&mask);
    }
    for (int i = 0; i < 3 * OCCLUSION_CELLS; i++) assert_true(fabsf(residual[0][i] - residual[1][i]) < 1e-4f);
}

// Whether a step at a photo that is clipped everywhere, or next to it, moves the colours of T and of R.
// behind: known to be behind the pane.
static void look_at_lamps(const char *device, float trust, bool flash, int mirrored, bool behind, bool moved[2])
{
    Scene scene = make_scene(&kinds[0]), after = {0};
    const Camera camera = make_camera();
    Image photo = {0}, mask = {0};
    StepResult result;
    assert_int_equal(fs_image_new(&photo, W, H, 3, NULL), 0);
    assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
    for (int i = 0; i < W * H * 3; i++) photo.px[i] = 6, mask.px[i / 3] = trust;
    Engine *engine = open_engine(device, &scene);
    unsigned char lamps[OCCLUSION_CELLS];
    memset(lamps, behind, sizeof lamps);
    const EngineView view = {&camera, flash, &photo, &mask, unlike, 0, 0, lamps};
    StepArgs args = make_args(&scene);
    args.rate[CLOUD_COLORS] = 0.01;
    args.lamps_mirrored = mirrored;
    assert_int_equal(fs_engine_load_view(engine, &view, NULL), 0);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    assert_true(result.loss[LOSS_L1] > 0.1);
    assert_int_equal(fs_engine_scene_down(engine, 1u << LAYER_T_N | 1u << LAYER_R, &after, NULL), 0);
    for (int k = 0; k < 2; k++) {
        Layer layer = k ? LAYER_R : LAYER_T_N;
        double most = 0;
        for (int i = 0; i < 3 * scene.cloud[layer].n; i++)
            most = fmax(most, fabs((double)scene.cloud[layer].field[CLOUD_COLORS][i] -
                                   (double)after.cloud[layer].field[CLOUD_COLORS][i]));
        moved[k] = most > 0.005;
    }
    fs_engine_free(engine);
    fs_scene_free(&scene);
    fs_scene_free(&after);
    fs_image_free(&photo);
    fs_image_free(&mask);
}

static void test_lamps(void **state)
{
    (void)state;
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++) for (int mirrored = 0; mirrored < 2; mirrored++)
    {
        bool moved[2];
        for (int part = 0; part < 3; part++) {
            float trust = part == 2 ? 1 : (float)part * FS_MASK_PART;
            for (int behind = 0; behind < 2; behind++) {
                look_at_lamps(devices[d], trust, flash == 1, mirrored, behind == 1, moved);
                assert_true(moved[0] == (flash || !mirrored || trust >= 1 || behind) && moved[1]);
            }
        }
    }
}

// A step leaves no colour darker, and no beta less, than it is told.
static void test_darkest(void **state)
{
    (void)state;
    FOR_DEVICES(d) for (int bound = 0; bound < 2; bound++)
    {
        Scene scene = make_scene(&kinds[3]), after = {0};
        const Camera camera = make_camera();
        StepResult result;
        Engine *engine = open_engine(devices[d], &scene);
        StepArgs args = make_args(&scene);
        args.rate[CLOUD_COLORS] = 0.01;
        args.darkest[LAYER_R] = bound ? 0.6 : 0;
        args.darkest[LAYER_BETA] = bound ? 0.5 : 0;
        load_photo(engine, &camera, false);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        assert_int_equal(fs_engine_scene_down(engine, 1u << LAYER_R | 1u << LAYER_BETA, &after, NULL), 0);
        const Cloud *R = &after.cloud[LAYER_R], *beta = &after.cloud[LAYER_BETA];
        int dark = 0, little = 0;
        for (int i = 0; i < 3 * R->n; i++) dark += R->field[CLOUD_COLORS][i] < 0.6f;
        for (int i = 0; i < beta->n; i++) little += beta->field[CLOUD_COLORS][i] < 0; // a logit
        assert_true(bound ? dark == 0 && little == 0 : dark > 0 && little > 0);
        fs_engine_free(engine);
        fs_scene_free(&scene);
        fs_scene_free(&after);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unseen_is_what_is_around),
        cmocka_unit_test(test_residual),
        cmocka_unit_test(test_lamps),
        cmocka_unit_test(test_darkest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

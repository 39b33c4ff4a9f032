// The training stage's own parts: schedules, costs, the order of photos, the table of loss terms.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "temp_dir.h"
#include "train/train.h"
#include "train/trainer.h"

static FsSettings *settings(const char *preset, const char *steps)
{
    FsSettings *set = fs_settings_new();
    assert_non_null(set);
    assert_int_equal(fs_settings_set(set, "preset", preset, NULL), 0);
    assert_int_equal(fs_settings_set(set, "steps", steps, NULL), 0);
    return set;
}

static void test_schedule(void **state)
{
    (void)state;
    FsSettings *set = settings("preview", "1000");
    Scene scene = {.shared_geometry = true, .pane_beta = true, .extent = 2};
    StepArgs first, late, last;
    fs_schedule_step(set, &scene, 0, &first);
    fs_schedule_step(set, &scene, 799, &late);
    fs_schedule_step(set, &scene, 999, &last);
    assert_true(!first.veil_ambient && late.veil_ambient); // once the scenes stand
    assert_true(first.lamps_mirrored && !late.lamps_mirrored);
    assert_true(fabs(first.rate[CLOUD_MEANS] / (4e-3 * 2) - pow(0.01, 0.001)) < 1e-9);
    assert_true(fabs(last.rate[CLOUD_MEANS] / (4e-3 * 2) - 0.01) < 1e-9);
    assert_true(fabs(first.rate[CLOUD_COLORS] - 2 * 2.5e-3) < 1e-12 && first.rate[CLOUD_OPACITIES] == 5e-2);
    assert_true(late.rate[CLOUD_COLORS] == first.rate[CLOUD_COLORS]);
    assert_true(fabs(last.rate[CLOUD_COLORS] - 0.1 * first.rate[CLOUD_COLORS]) < 1e-9); // settled
    assert_true(first.statistics);
    assert_true(first.darkest[LAYER_T_N] == 0.1 && first.darkest[LAYER_R] == 0.2 && first.darkest[LAYER_BETA] == 0);
    assert_true(first.weight[LOSS_GAIN_PUSH] > 0 && first.weight[LOSS_MIRRORED_LIGHT] == 0);
    scene.rare = 0.5; // little is mirrored
    fs_schedule_step(set, &scene, 0, &first);
    fs_schedule_step(set, &scene, 799, &late);
    assert_true(first.weight[LOSS_GAIN_PUSH] == 0 && !first.lamps_mirrored);
    assert_true(late.weight[LOSS_MIRRORED_LIGHT] > 0);
    assert_true(first.weight[LOSS_MIRRORED_LIGHT] > 10 * late.weight[LOSS_MIRRORED_LIGHT]); // R is held dark at first
    scene.separation = SEPARATION_LINEAR;
    fs_schedule_step(set, &scene, 0, &first);
    assert_true(first.rate[CLOUD_GAINS] == 0);
    assert_false(fs_schedule_relocates(set, 0));
    assert_true(fs_schedule_relocates(set, 100) && fs_schedule_relocates(set, 800));
    assert_false(fs_schedule_relocates(set, 150) || fs_schedule_relocates(set, 900));
    fs_settings_free(set);
    set = settings("paper", "500");
    fs_schedule_step(set, &scene, 499, &last);
    assert_true(last.statistics);
    assert_true(fabs(last.rate[CLOUD_MEANS] / (1.6e-4 * 2) - pow(0.01, 0.05)) < 1e-9); // over 10000 steps
    assert_true(fs_schedule_fsgs(500) && fs_schedule_fsgs(10000));
    assert_false(fs_schedule_fsgs(400) || fs_schedule_fsgs(550) || fs_schedule_fsgs(10100));
    fs_settings_free(set);
}

// Half of the pixels where these are enough, a quarter where that is.
static void test_stride(void **state)
{
    (void)state;
    const struct {
        double pixels;
        int stride[2];
    } wanted[] = {{900, {1, 1}}, {1999, {1, 1}}, {2000, {1, 2}}, {3999, {1, 2}}, {4000, {2, 2}}, {9000, {2, 2}}};
    FsSettings *set = settings("standard", "1000");
    int stride[2];
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        assert_int_equal(fs_settings_set(set, "pixels-per-splat", "2", NULL), 0);
        fs_schedule_stride(set, 0, wanted[i].pixels, 500, stride);
        assert_memory_equal(stride, wanted[i].stride, sizeof stride);
        fs_schedule_stride(set, 1, wanted[i].pixels, 500, stride); // small photos, at the beginning: all
        assert_true(stride[0] == 1 && stride[1] == 1);
        assert_int_equal(fs_settings_set(set, "pixels-per-splat", "0", NULL), 0);
        fs_schedule_stride(set, 0, wanted[i].pixels, 500, stride);
        assert_true(stride[0] == 1 && stride[1] == 1); // all
    }
    fs_settings_free(set);
}

// From coarse photos to full ones, whatever the number of steps, and clouds that grow to their budget and no further.
static void test_levels(void **state)
{
    (void)state;
    FsSettings *set = settings("paper", "1000");
    for (int step = 0; step < 1000; step++) assert_int_equal(fs_schedule_halvings(set, 1200, step), 0);
    for (int steps = 1; steps <= 3000; steps += 37) {
        char text[20];
        snprintf(text, sizeof text, "%d", steps);
        assert_int_equal(fs_settings_set(set, "steps", text, NULL), 0);
        for (int levels = 2; levels <= 8; levels += 3) {
            int last = levels - 1, times[8] = {0};
            snprintf(text, sizeof text, "%d", levels);
            assert_int_equal(fs_settings_set(set, "levels", text, NULL), 0);
            for (int step = 0; step < steps; step++) {
                int halvings = fs_schedule_halvings(set, 1 << 20, step);
                assert_true(halvings >= 0 && halvings <= last);
                last = halvings;
                times[halvings]++;
            }
            assert_int_equal(last, 0);
            assert_true(times[0] >= (int)(0.4 * steps)); // most of what a picture needs is found at its size
            if (steps > 100)
                for (int l = 0; l < levels; l++) assert_true(times[l] > 0);
        }
    }
    assert_int_equal(fs_schedule_halvings(set, 300, 0), 1); // smaller ones would show nothing
    assert_int_equal(fs_schedule_halvings(set, 199, 0), 0);
    fs_settings_free(set);

    set = settings("preview", "3000");
    int n = 24000, before, budget = fs_schedule_budget(set, 6e4);
    for (int step = 100; step <= 1800; step += 100) {
        before = n;
        n = fs_schedule_grown(set, budget, n, step);
        assert_true(n > before && n <= budget && n < 1.2 * before);
    }
    assert_int_equal(n, budget);
    assert_int_equal(fs_schedule_grown(set, budget, 2 * budget, 2000), 2 * budget);
    assert_in_range(fs_schedule_budget(set, 4 * 6e4), 2 * budget, 2 * budget + 1);
    assert_int_equal(fs_settings_set(set, "max-splats", "7000", NULL), 0);
    assert_int_equal(fs_schedule_budget(set, 6e4), 7000);
    fs_settings_free(set);
}

static void test_cost(void **state)
{
    (void)state;
    FsSettings *set = fs_settings_new();
    RunSize size = {30, 1200, 800, 0, 0}, large = {60, 2400, 1600, 0, 0}, tiny = {4, 120, 80, 0, 0};
    double bytes = fs_train_bytes(set, &size);
    assert_true(bytes > 1.1e9 && bytes < 1.5e9);
    assert_true(fs_train_bytes(set, &large) > 3.6e9); // the photos alone
    size.splats = 2000000;                            // more than the budget: they stay
    assert_true(fs_train_bytes(set, &size) > bytes + 2 * 1.8e6 * 300);

    FsProject project = {.set = *set};
    project.set.init_count = 500;
    TrainPace pace;
    assert_int_equal(fs_train_time(&project, &tiny, &pace, NULL), 0);
    assert_true(pace.splats[0] == 500 && pace.splats[1] > 10000 && pace.render > 0 && pace.step[0][1] > 0);
    fs_settings_free(set);
}

// As many steps as fit, by a pace that is given: small photos take 1 ms, large ones 3 to 7 ms as clouds grow.
static void test_steps_that_fit(void **state)
{
    (void)state;
    FsSettings *set = settings("standard", "3400");
    RunSize size = {30, 200, 150, 0, 1000};
    assert_int_equal(fs_settings_set(set, "max-splats", "3000", NULL), 0);
    assert_int_equal(fs_settings_set(set, "levels", "2", NULL), 0);
    TrainPace pace = {.splats = {1000, 3000}, .step = {{3e-3, 7e-3}, {1e-3, 1e-3}}};
    double all = fs_train_seconds(set, &size, &pace, 3400), before = 0;
    assert_true(all > 1700 * (1e-3 + 6e-3) && all < 1.8 * 1700 * (1e-3 + 7e-3));
    assert_int_equal(fs_train_steps(set, &size, &pace, all), 3400);
    assert_int_equal(fs_train_steps(set, &size, &pace, 10 * all), 3400);
    assert_int_equal(fs_train_steps(set, &size, &pace, -1), 300);
    for (double seconds = 2; seconds < all; seconds *= 1.5) {
        int steps = fs_train_steps(set, &size, &pace, seconds);
        assert_true(steps > before && fs_train_seconds(set, &size, &pace, steps) <= seconds);
        assert_true(fs_train_seconds(set, &size, &pace, steps + 10) > seconds);
        before = steps;
    }
    fs_settings_free(set);

    set = settings("paper", "5000"); // four clouds that grow from step 500 on
    RunSize paper = {30, 1200, 800, 0, 0};
    assert_true(fs_train_bytes(set, &paper) > 4 * 500000 * 300.0);
    assert_int_equal(fs_settings_set(set, "steps", "400", NULL), 0);
    assert_true(fs_train_bytes(set, &paper) < 30e6 + 0.96e6 * (40 * 30 + 730) + 4 * 360000 * 740.0);
    fs_settings_free(set);
}

// Every photo once an epoch, shuffled, however many there are.
static void test_order_of_photos(void **state)
{
    (void)state;
    const int sizes[] = {1, 7, 1024, 1025, 3000};
    FsSettings *set = settings("preview", "10");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        int n = sizes[s], in_place = 0;
        Trainer trainer = {.set = set, .n_views = n, .epoch = -1, .order = calloc((size_t)n, sizeof(int))};
        int *times = calloc((size_t)n, sizeof(int)), *first = calloc((size_t)n, sizeof(int)), same = 0;
        for (int step = 0; step < 2 * n; step++) {
            int view = fs_views_at_step(&trainer, step);
            assert_true(view >= 0 && view < n);
            times[view]++;
            if (step < n) first[step] = view, in_place += view == step;
            if (step >= n) same += first[step - n] == view;
        }
        for (int i = 0; i < n; i++) assert_int_equal(times[i], 2);
        if (n > 100) assert_true(in_place < n / 10 && same < n / 10);
        trainer.epoch = -1; // as after a checkpoint
        assert_int_equal(fs_views_at_step(&trainer, n / 2), first[n / 2]);
        free(trainer.order), free(times), free(first);
    }
    fs_settings_free(set);
}

// ---- loss terms ----

static void test_loss_table(void **state)
{
    (void)state;
    FsSettings *set = settings("preview", "10");
    size_t n_options;
    const FsOption *options = fs_settings_options(&n_options);
    double weight[LOSS_TERMS];
    for (int k = 0; k < LOSS_TERMS; k++) {
        const LossInfo *term = &fs_loss_terms[k];
        bool found = false;
        assert_true(term->name && term->setting && (term->layers || term->photo || term->response));
        for (size_t i = 0; i < n_options; i++)
            found |= strcmp(options[i].name, term->setting) == 0 && options[i].stages & FS_STAGE_TRAIN;
        assert_true(found);
        for (int j = 0; j < k; j++) assert_string_not_equal(fs_loss_terms[j].name, term->name);
        assert_int_equal(fs_settings_set(set, term->setting, "0.5", NULL), 0);
    }
    Scene scene = {.shared_geometry = true, .pane_beta = true, .extent = 1};
    fs_loss_weights(set, &scene, 0, weight);
    assert_true(weight[LOSS_L1] == 0 && weight[LOSS_DSSIM] == 0.25 && weight[LOSS_CONTRAST] == 0.25);
    assert_int_equal(fs_settings_set(set, "dssim", "0.2", NULL), 0);
    fs_loss_weights(set, &scene, 0, weight);
    assert_true(fabs(weight[LOSS_L1] - 0.15) < 1e-12 && weight[LOSS_SCALE_REG] == 0.5);
    assert_true(weight[LOSS_LINEARITY] == 0 && weight[LOSS_BETA_SMOOTH] == 0 && weight[LOSS_GAIN_SMOOTH] == 0.5);
    assert_true(weight[LOSS_OPAQUE] == 0 && !fs_loss_looks(weight, LAYER_R).transmittance);
    assert_true(fs_loss_looks(weight, LAYER_R).depth && !fs_loss_looks(weight, LAYER_BETA).depth);
    fs_loss_weights(set, &scene, 0.5, weight);
    assert_true(fabs(weight[LOSS_OPAQUE] - 0.25) < 1e-12 && fs_loss_looks(weight, LAYER_T_N).transmittance);
    assert_true(weight[LOSS_GAIN_PUSH] == 0.5);
    fs_loss_weights(set, &scene, 0.8, weight);
    assert_true(weight[LOSS_GAIN_PUSH] == 0 && weight[LOSS_GAIN_SMOOTH] == 0.5);
    scene.separation = SEPARATION_LINEAR;
    fs_loss_weights(set, &scene, 0.7, weight);
    assert_true(weight[LOSS_GAIN_SMOOTH] == 0 && weight[LOSS_GAIN_PUSH] == 0 && weight[LOSS_OPAQUE] == 0.5);
    scene = (Scene){.extent = 1}; // the paper's four clouds
    scene.cloud[LAYER_BETA].n = 1;
    fs_loss_weights(set, &scene, 0.7, weight);
    assert_true(weight[LOSS_LINEARITY] == 0.5 && weight[LOSS_BETA_SMOOTH] == 0.5 && weight[LOSS_GAIN_PUSH] == 0);
    fs_settings_free(set);
}

// The look at the pane is had, and counted in the estimate, where bars or dirt are looked for and can be.
static void test_pane_look(void **state)
{
    (void)state;
    static const struct {
        const char *name, *value;
        bool had;
    } other[] = {{"bars", "false", true},       {"dirt", "false", true},         {"depth-smooth", "0.01", true},
                 {"steps", "1247", false},      {"steps", "1248", true},         {"separation", "linear", false},
                 {"separation", "none", false}, {"geometry", "separate", false}, {"beta", "cloud", false},
                 {"model", "field", false}};
    RunSize size = {.photos = 24, .width = 300, .height = 200};
    TrainPace pace = {.splats = {1000, 3000}, .step = {{3e-3, 7e-3}, {1e-3, 1e-3}}};
    for (size_t i = 0; i < sizeof other / sizeof *other; i++) {
        FsSettings *set = fs_settings_new();
        assert_int_equal(fs_settings_set(set, "photographer", "false", NULL), 0);
        assert_int_equal(fs_settings_set(set, other[i].name, other[i].value, NULL), 0);
        int steps = fs_pane_look_steps(set);
        assert_int_equal(steps > 0, other[i].had);
        double with = fs_train_seconds(set, &size, &pace, set->steps);
        assert_int_equal(fs_settings_set(set, "bars", "false", NULL), 0);
        assert_int_equal(fs_settings_set(set, "dirt", "false", NULL), 0);
        assert_int_equal(fs_pane_look_steps(set), 0);
        double more = with - fs_train_seconds(set, &size, &pace, set->steps);
        assert_true(other[i].had ? more > steps * 1e-3 : more == 0);
        fs_settings_free(set);
    }
    assert_int_equal(fs_pane_look_halvings(300), 0);
    assert_int_equal(fs_pane_look_halvings(1200), 2);
}

// What bends as cameras' curves do costs nothing, the other way and elsewhere it does; and the gradient.
static void test_response_smooth(void **state)
{
    (void)state;
    double (*const term)(const double *, double, double *) = fs_loss_terms[LOSS_RESPONSE_SMOOTH].response;
    // Second differences: 0.7 and 1 at the toe; the shoulder. Straight lines are added to both.
    const double toe[FS_OPTICS_KNOTS] = {0, 0.1, 0.2, 0.3, 1.1, 2.9, 4.7, 6.5, 8.3, 10.1, 11.9};
    double shoulder[FS_OPTICS_KNOTS] = {0, 1, 2, 3, 4, 5};
    const double bends[] = {-0.3, -0.8, -1, -1.3, -1.5};
    for (int k = 0; k < 5; k++) shoulder[k + 6] = 2 * shoulder[k + 5] - shoulder[k + 4] + bends[k];
    double x[FS_OPTICS_KNOTS], gradient[FS_OPTICS_KNOTS] = {0}, other[FS_OPTICS_KNOTS] = {0};
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) x[k] = 0.03 * shoulder[k];
    assert_true(fabs(term(x, 1, gradient)) < 1e-12);
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) assert_true(fabs(gradient[k]) < 1e-12);
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) x[k] = -0.03 * shoulder[k];
    assert_true(term(x, 1, gradient) > 1e-3);
    assert_true(fabs(term(toe, 1, gradient)) < 1e-12);
    Rng rng = fs_rng_new(2);
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) x[k] = 0.05 * ((double)fs_rng_uniform(&rng) - 0.5) - 0.03 * shoulder[k];
    memset(gradient, 0, sizeof gradient);
    assert_true(term(x, 0.5, gradient) > 0);
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) {
        double value[2];
        for (int side = 0; side < 2; side++) {
            double keep = x[k];
            x[k] += side ? 1e-5 : -1e-5;
            value[side] = 0.5 * term(x, 0.5, other);
            x[k] = keep;
        }
        assert_true(fabs((value[1] - value[0]) / 2e-5 - gradient[k]) < 1e-6);
    }
}

// What the start found behind the pane, in the cells of a photo that show it, and none where it found nothing.
static void test_lamps(void **state)
{
    char *dir = *state;
    const View view = {.camera = {640, 480, 600, 600, 320, 240, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
    const View *views[1] = {&view};
    const float xyz[6] = {0.5f, -0.2f, 2, 0, 0, -2}; // pixel 470, 180, and behind the camera
    const unsigned char rgb[6] = {0};
    char *start = fs_file_path("%s/start", dir), *path = fs_file_path("%s/start/lamps.ply", dir);
    assert_int_equal(fs_file_mkdirs(start, NULL), 0);
    for (int n = -1; n < 3; n++) { // no file, as radiance fields have none; an empty one
        FsProject project = {.out = dir};
        Trainer trainer = {.project = &project, .views = views, .n_views = 1};
        int marked = 0;
        if (n >= 0) assert_int_equal(fs_cloud_points_write(path, n, xyz, rgb, NULL, NULL), 0);
        assert_int_equal(fs_lamps_behind_read(&trainer, NULL), 0);
        for (int i = 0; i < OCCLUSION_CELLS; i++) marked += trainer.lamps[i];
        assert_int_equal(marked, n > 0 ? 9 : 0);
        assert_int_equal(trainer.lamps[18 * OCCLUSION_WIDTH + 47], n > 0);
        free(trainer.lamps);
    }
    free(start);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_schedule),
        cmocka_unit_test(test_levels),
        cmocka_unit_test(test_stride),
        cmocka_unit_test(test_cost),
        cmocka_unit_test(test_steps_that_fit),
        cmocka_unit_test(test_order_of_photos),
        cmocka_unit_test(test_loss_table),
        cmocka_unit_test(test_pane_look),
        cmocka_unit_test(test_response_smooth),
        cmocka_unit_test_setup_teardown(test_lamps, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// The training stage's own parts: edits of clouds, relocation, the paper's densification, schedules, the order of
// photos, the table of loss terms.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "train/cloud_edit.h"
#include "train/train.h"
#include "train/trainer.h"

enum { N = 200 };

// Opacity by number: i % 5 of 0 is dead.
static Cloud make_cloud(int n, int gains)
{
    Cloud cloud;
    Rng rng = fs_rng_new(6);
    assert_int_equal(fs_cloud_new(&cloud, n, 3, gains, NULL), 0);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < 2; k++) cloud.field[CLOUD_MEANS][3 * i + k] = 1.6f * (fs_rng_uniform(&rng) - 0.5f);
        cloud.field[CLOUD_MEANS][3 * i + 2] = 2 + 0.5f * fs_rng_uniform(&rng);
        for (int k = 0; k < 3; k++) cloud.field[CLOUD_SCALES][3 * i + k] = -2.6f + 0.3f * fs_rng_normal(&rng);
        for (int k = 0; k < 4; k++) cloud.field[CLOUD_QUATS][4 * i + k] = fs_rng_normal(&rng);
        cloud.field[CLOUD_OPACITIES][i] = i % 5 == 0 ? -7 : -1 + fs_rng_uniform(&rng);
        for (int k = 0; k < 3; k++) cloud.field[CLOUD_COLORS][3 * i + k] = 0.4f + 0.5f * fs_rng_uniform(&rng);
    }
    return cloud;
}

static void test_edit(void **state)
{
    (void)state;
    Cloud cloud = make_cloud(6, 1);
    Edit edit;
    assert_int_equal(fs_cloud_edit_begin(&edit, &cloud, NULL), 0);
    assert_int_equal(fs_cloud_edit_append(&edit, 3, NULL), 0);
    fs_cloud_edit_copy(&edit, 7, 2);
    for (int k = 0; k < 3; k++) assert_true(cloud.field[CLOUD_MEANS][21 + k] == cloud.field[CLOUD_MEANS][6 + k]);
    assert_true(cloud.field[CLOUD_MEANS][18] == 0);
    const unsigned char keep[9] = {0, 1, 1, 0, 0, 1, 0, 1, 1};
    fs_cloud_edit_compact(&edit, keep);
    const int from[5] = {1, 2, 5, -1, -1};
    assert_int_equal(cloud.n, 5);
    assert_memory_equal(edit.from, from, sizeof from);
    assert_true(cloud.field[CLOUD_SCALES][9] == cloud.field[CLOUD_SCALES][3]); // the copy of 2, and 2
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);
}

// ---- relocation ----

static void render_cloud(const Cloud *cloud, Image *image)
{
    Scene scene = {.extent = 1, .flash_distance = 1, .pane_beta = true, .pane = {{0, 0, 1}, 0.1, 0.1}};
    Engine *engine;
    Renders renders = {0};
    const Camera camera = {64, 48, 50, 50, 32, 24, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    assert_int_equal(fs_cloud_copy(&scene.cloud[LAYER_T_N], cloud, NULL), 0);
    assert_int_equal(fs_engine_new(&engine, "auto", "best", 1, NULL), 0);
    assert_int_equal(fs_engine_scene_up(engine, &scene, NULL), 0);
    assert_int_equal(fs_engine_render(engine, &camera, &renders, NULL), 0);
    *image = renders.layer[RENDER_T_N];
    renders.layer[RENDER_T_N] = (Image){0};
    fs_engine_renders_free(&renders);
    fs_engine_free(engine);
    fs_scene_free(&scene);
}

static double psnr(const Image *a, const Image *b)
{
    double sum = 0, most = 0;
    int n = a->width * a->height * 3;
    for (int i = 0; i < n; i++) {
        sum += pow((double)a->px[i] - (double)b->px[i], 2);
        most = fmax(most, (double)a->px[i]);
    }
    return 10 * log10(most * most * n / sum);
}

// What is moved or added lands on what is there, and the picture hardly changes.
static void test_relocation_keeps_the_picture(void **state)
{
    (void)state;
    for (int grown = N; grown <= N + 40; grown += 40) {
        Cloud cloud = make_cloud(N, 0);
        Image before, after;
        Edit edit;
        Rng rng = fs_rng_new(2);
        render_cloud(&cloud, &before);
        assert_int_equal(fs_cloud_edit_begin(&edit, &cloud, NULL), 0);
        assert_int_equal(fs_densify_relocate(&edit, grown, NULL, &rng, NULL), 0);
        render_cloud(&cloud, &after);
        assert_int_equal(cloud.n, grown);
        assert_true(psnr(&before, &after) > 30);
        int fresh = 0;
        for (int i = 0; i < grown; i++) {
            assert_true(fs_cloud_edit_sigmoid(cloud.field[CLOUD_OPACITIES][i]) > 0.004f); // nobody is dead
            assert_true(edit.from[i] == -1 || edit.from[i] == i);
            fresh += edit.from[i] == -1;
            if (i % 5 == 0 || i >= N) assert_int_equal(edit.from[i], -1);
        }
        assert_true(fresh > N / 5 + grown - N && fresh < grown); // with those that they landed on
        fs_cloud_edit_free(&edit);
        fs_image_free(&before), fs_image_free(&after);
        fs_cloud_free(&cloud);
    }
}

// One Gaussian becomes a row: evenly along its longest axis, with its mean, its variance, its turn and its other axes.
static void test_row(void **state)
{
    (void)state;
    const double angle = 0.7, along[3] = {cos(angle), sin(angle), 0};
    for (int n = 2; n <= 60; n += n < 5 ? 1 : 11) {
        Cloud cloud = make_cloud(1, 0);
        const float mean[3] = {0.1f, -0.2f, 2}, scale[3] = {logf(0.1f), logf(0.06f), logf(0.09f)};
        const float quat[4] = {(float)cos(angle / 2), 0, 0, (float)sin(angle / 2)};
        memcpy(cloud.field[CLOUD_MEANS], mean, sizeof mean);
        memcpy(cloud.field[CLOUD_SCALES], scale, sizeof scale);
        memcpy(cloud.field[CLOUD_QUATS], quat, sizeof quat);
        cloud.field[CLOUD_OPACITIES][0] = fs_cloud_edit_logit(0.8f);
        Image before, after;
        Edit edit;
        Rng rng = fs_rng_new(2);
        render_cloud(&cloud, &before);
        assert_int_equal(fs_cloud_edit_begin(&edit, &cloud, NULL), 0);
        assert_int_equal(fs_densify_relocate(&edit, n, NULL, &rng, NULL), 0);
        render_cloud(&cloud, &after);
        assert_true(psnr(&before, &after) > 35);
        double own = exp(2 * (double)cloud.field[CLOUD_SCALES][0]), variance = 0, middle = 0, nearest = 1;
        assert_true(own < 0.8 * 0.1 * 0.1);
        for (int i = 0; i < n; i++) {
            double at = 0, off = 0;
            for (int k = 0; k < 3; k++)
                at += along[k] * ((double)cloud.field[CLOUD_MEANS][3 * i + k] - (double)mean[k]);
            for (int k = 0; k < 3; k++)
                off = fmax(off, fabs((double)cloud.field[CLOUD_MEANS][3 * i + k] - (double)mean[k] - at * along[k]));
            assert_true(off < 1e-5);
            middle += at / n, variance += at * at / n;
            for (int k = 0; k < 3; k++)
                assert_true(cloud.field[CLOUD_SCALES][3 * i + k] == (k ? scale[k] : cloud.field[CLOUD_SCALES][0]));
            assert_memory_equal(cloud.field[CLOUD_QUATS] + 4 * i, quat, sizeof quat);
            for (int j = 0; j < i; j++) {
                const float *x = cloud.field[CLOUD_MEANS] + 3 * i, *y = cloud.field[CLOUD_MEANS] + 3 * j;
                nearest = fmin(nearest, hypot((double)(x[0] - y[0]), (double)(x[1] - y[1])));
            }
        }
        assert_true(fabs(middle) < 1e-5 && fabs(variance + own - 0.1 * 0.1) < 1e-4 * 0.1 * 0.1);
        assert_true(nearest > 0.1 / n); // nobody stands on another
        fs_cloud_edit_free(&edit);
        fs_image_free(&before), fs_image_free(&after);
        fs_cloud_free(&cloud);
    }
}

static void test_all_dead(void **state)
{
    (void)state;
    Cloud cloud = make_cloud(10, 0);
    for (int i = 0; i < 10; i++) cloud.field[CLOUD_OPACITIES][i] = -9;
    Edit edit;
    Rng rng = fs_rng_new(2);
    FsError err;
    float screen[10] = {0};
    FsgsArgs args = {screen, 1, 100, 3000, NULL};
    assert_int_equal(fs_cloud_edit_begin(&edit, &cloud, NULL), 0);
    assert_int_equal(fs_densify_relocate(&edit, 12, NULL, &rng, &err), FS_ERR_NUMERIC);
    assert_int_equal(fs_fsgs_densify(&edit, &args, &rng, &err), FS_ERR_NUMERIC);
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);
}

// ---- the paper's densification ----

static int densify(Cloud *cloud, float *screen, double extent, int most, int step, Edit *edit)
{
    Rng rng = fs_rng_new(2);
    FsgsArgs args = {screen, extent, most, step, NULL};
    assert_int_equal(fs_cloud_edit_begin(edit, cloud, NULL), 0);
    assert_int_equal(fs_fsgs_densify(edit, &args, &rng, NULL), 0);
    return cloud->n;
}

static void test_fsgs(void **state)
{
    (void)state;
    float screen[N] = {0};
    Edit edit;
    screen[1] = screen[2] = 1e-3f; // above the threshold; number 2 is large, number 1 is not
    Cloud cloud = make_cloud(N, 0);
    for (int k = 0; k < 3; k++) cloud.field[CLOUD_SCALES][3 + k] = -6, cloud.field[CLOUD_SCALES][6 + k] = -1;
    assert_int_equal(densify(&cloud, screen, 1, 1000, 2500, &edit), N - N / 5 + 2); // pruned, cloned, split
    assert_int_equal(edit.forget, 0);
    assert_int_equal(edit.from[0], 1); // number 0 was pruned
    assert_int_equal(edit.from[cloud.n - 1], -1);
    const float *means = cloud.field[CLOUD_MEANS], *scales = cloud.field[CLOUD_SCALES];
    for (int k = 0; k < 3; k++) {
        assert_true(means[k] == means[3 * (cloud.n - 2) + k]); // a clone
        assert_true(fabsf(scales[3 + k] - (-1 - logf(1.6f))) < 1e-5f && scales[3 + k] == scales[3 * (cloud.n - 1) + k]);
    }
    assert_true(means[3] != means[3 * (cloud.n - 1)]); // a split is two samples
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);

    cloud = make_cloud(N, 0); // no room
    assert_int_equal(densify(&cloud, screen, 1, N, 2500, &edit), N - N / 5);
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);

    cloud = make_cloud(N, 0); // few, and far from one another: new ones between neighbours
    for (int i = 0; i < 3 * N; i++) cloud.field[CLOUD_MEANS][i] *= 40, cloud.field[CLOUD_SCALES][i] = 0;
    memset(screen, 0, sizeof screen);
    assert_true(densify(&cloud, screen, 1, 100000, 1000, &edit) > 2 * N);
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);

    cloud = make_cloud(N, 0); // opacities are reset
    for (int i = 0; i < N; i++) cloud.field[CLOUD_OPACITIES][i] = 3;
    assert_int_equal(densify(&cloud, screen, 1, 1000, 3000, &edit), N);
    assert_int_equal(edit.forget, 1u << CLOUD_OPACITIES);
    for (int i = 0; i < N; i++)
        assert_true(fabsf(fs_cloud_edit_sigmoid(cloud.field[CLOUD_OPACITIES][i]) - 0.05f) < 1e-4f);
    fs_cloud_edit_free(&edit);
    fs_cloud_free(&cloud);
}

// ---- schedules ----

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
    assert_true(first.explore > 0 && first.statistics);
    assert_true(first.darkest[LAYER_T_N] == 0.1 && first.darkest[LAYER_R] == 0.2);
    scene.separation = SEPARATION_LINEAR;
    fs_schedule_step(set, &scene, 0, &first);
    assert_true(first.rate[CLOUD_GAINS] == 0);
    assert_false(fs_schedule_relocates(set, 0));
    assert_true(fs_schedule_relocates(set, 100) && fs_schedule_relocates(set, 800));
    assert_false(fs_schedule_relocates(set, 150) || fs_schedule_relocates(set, 900));
    fs_settings_free(set);
    set = settings("paper", "500");
    fs_schedule_step(set, &scene, 499, &last);
    assert_true(last.statistics && last.explore == 0);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edit),
        cmocka_unit_test(test_relocation_keeps_the_picture),
        cmocka_unit_test(test_row),
        cmocka_unit_test(test_all_dead),
        cmocka_unit_test(test_fsgs),
        cmocka_unit_test(test_schedule),
        cmocka_unit_test(test_levels),
        cmocka_unit_test(test_stride),
        cmocka_unit_test(test_cost),
        cmocka_unit_test(test_steps_that_fit),
        cmocka_unit_test(test_order_of_photos),
        cmocka_unit_test(test_loss_table),
        cmocka_unit_test(test_pane_look),
        cmocka_unit_test(test_response_smooth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

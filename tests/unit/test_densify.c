// Edits of clouds, relocation, and the paper's densification.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "train/cloud_edit.h"
#include "train/train_constants.h"
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

// What is near and wide before a camera becomes transparent; what is small, as far as the scene, or behind it stays.
static void test_curtains(void **state)
{
    (void)state;
    const Camera camera = {64, 48, 50, 50, 32, 24, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    const View view = {.camera = camera}, *views[] = {&view};
    static const struct {
        float z, scale[3];
        bool opened;
    } cases[] = {{0.4f, {0, -6, 0}, true},   {0.9f, {1, 1, -3}, true},   {-0.2f, {0, 0, 0}, true},
                 {0.4f, {-5, -5, 0}, false}, {0.4f, {0, -6, -6}, false}, {1.5f, {0, 0, 0}, false},
                 {2.2f, {2, 2, 2}, false},   {-2, {0, 0, 0}, false}};
    enum { CASES = sizeof cases / sizeof *cases };
    Trainer trainer = {.views = views, .n_views = 1};
    trainer.scene.cloud[LAYER_T_N] = make_cloud(N, 1);
    trainer.scene.cloud[LAYER_R] = make_cloud(N, 0);
    Cloud before[2] = {make_cloud(N, 1), make_cloud(N, 0)};
    for (int l = LAYER_T_N; l <= LAYER_R; l++) // 3 of T are less than a fiftieth
        for (int i = 0; i < (l == LAYER_R ? CASES : 3); i++) {
            float *const *field = trainer.scene.cloud[l].field;
            const float mean[3] = {0.1f, 0, cases[i].z};
            memcpy(field[CLOUD_MEANS] + 3 * i, mean, sizeof mean);
            memcpy(field[CLOUD_SCALES] + 3 * i, cases[i].scale, sizeof cases[i].scale);
            field[CLOUD_OPACITIES][i] = 1;
        }
    assert_int_equal(fs_curtains_open(&trainer, NULL), 0);
    for (int l = LAYER_T_N; l <= LAYER_R; l++) {
        const float *logit = trainer.scene.cloud[l].field[CLOUD_OPACITIES],
                    *was = before[l - LAYER_T_N].field[CLOUD_OPACITIES];
        int changed = l == LAYER_R ? CASES : 3;
        for (int i = 0; i < changed; i++)
            if ((fs_cloud_edit_sigmoid(logit[i]) <= OPACITY_DEAD) != cases[i].opened) fail_msg("case %d", i);
        assert_memory_equal(logit + changed, was + changed, sizeof *logit * (size_t)(N - changed));
    }
    for (int l = 0; l < LAYERS; l++) fs_cloud_free(&trainer.scene.cloud[l]);
    for (int k = 0; k < 2; k++) fs_cloud_free(&before[k]);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edit), cmocka_unit_test(test_relocation_keeps_the_picture),
        cmocka_unit_test(test_row),  cmocka_unit_test(test_all_dead),
        cmocka_unit_test(test_fsgs), cmocka_unit_test(test_curtains),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

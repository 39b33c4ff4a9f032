// The whole stage on a made-up capture on disk: what it writes, that threads do not matter, and what it refuses.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>

#include "base/file.h"
#include "initialise/initialise.h"
#include "made_capture.h"
#include "model/colmap_model.h"
#include "model/scene.h"
#include "said.h"
#include "temp_dir.h"

enum { POINTS = 300, COUNT = 1500 };

static void write_photos(const char *out, const SmallViews *views)
{
    Dataset dataset = {0};
    char *dir = fs_file_path("%s/images", out), *path = fs_file_path("%s/views.json", out);
    Image mask;
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_image_new(&mask, MADE_WIDTH, MADE_HEIGHT, 1, NULL), 0);
    for (int i = 0; i < MADE_WIDTH * MADE_HEIGHT; i++) mask.px[i] = 1;
    for (int i = 0; i < views->n; i++) {
        char name[20];
        snprintf(name, sizeof name, "p%02d", i);
        View view = {.name = name, .flash = views->view[i].flash, .camera = views->view[i].camera};
        char *photo = fs_file_path("%s/p%02d.tif", dir, i), *mask_path = fs_file_path("%s/p%02d_mask.png", dir, i);
        assert_int_equal(fs_dataset_append(&dataset, &view, NULL), 0);
        assert_int_equal(fs_tiff_write_float(photo, &views->view[i].photo, NULL), 0);
        assert_int_equal(fs_png_write(mask_path, &mask, 8, NULL), 0);
        free(photo);
        free(mask_path);
    }
    assert_int_equal(fs_dataset_write(&dataset, path, NULL), 0);
    fs_dataset_free(&dataset);
    fs_image_free(&mask);
    free(dir);
    free(path);
}

static void write_points(const char *out, const SmallViews *views, int n)
{
    ColmapModel model = {0};
    char *dir = fs_file_path("%s/sparse", out);
    Rng rng = fs_rng_new(9);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    ColmapCamera *camera = fs_colmap_model_add_camera(&model, NULL);
    camera->id = 1;
    camera->lens = fs_lens_from_camera(&views->view[0].camera);
    ColmapImage *image = fs_colmap_model_add_image(&model, "p00.JPG", NULL);
    image->id = image->camera_id = 1;
    image->quat[0] = 1;
    for (int i = 0; i < n; i++) {
        ColmapPoint *point = fs_colmap_model_add_point(&model, NULL);
        double z = i % 2 ? MADE_DEPTH_T : MADE_DEPTH_R;
        point->id = i + 1;
        point->xyz[0] = ((double)fs_rng_uniform(&rng) - 0.5) * 0.5 * z;
        point->xyz[1] = ((double)fs_rng_uniform(&rng) - 0.5) * 0.3 * z;
        point->xyz[2] = z;
    }
    assert_int_equal(fs_colmap_model_write(dir, &model, false, NULL), 0);
    fs_colmap_model_free(&model);
    free(dir);
}

static const char *separation = "full";

static int run(const char *out, const char *threads, const char *geometry, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    FsCallbacks callbacks = {.log = said_keep};
    FsProject project = {(char *)out, {0}, callbacks};
    char count[20];
    snprintf(count, sizeof count, "%d", COUNT);
    assert_int_equal(fs_settings_set(settings, "threads", threads, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "geometry", geometry, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "beta", geometry[1] == 'h' ? "pane" : "cloud", NULL), 0);
    assert_int_equal(fs_settings_set(settings, "init-count", count, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "separation", separation, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "force", "true", NULL), 0);
    fs_settings_copy(&project.set, settings, NULL);
    said_forget();
    int rc = fs_initialise_run(&project, err);
    fs_settings_clear(&project.set);
    free(project.fingerprint);
    fs_settings_free(settings);
    return rc;
}

static void check_cloud(const Cloud *cloud, int colors, int gains)
{
    assert_int_equal(cloud->n, COUNT);
    assert_int_equal(cloud->width[CLOUD_COLORS], colors);
    assert_int_equal(cloud->width[CLOUD_GAINS], gains);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < cloud->n * cloud->width[f]; i++) assert_true(isfinite(cloud->field[f][i]));
}

// Starts that do not use the flash's cues: no gain, both scenes at all places; or one scene only.
static void check_comparisons(const char *out, const char *start)
{
    Scene scene;
    separation = "flashless";
    assert_int_equal(run(out, "2", "separate", NULL), 0); // the paper's: one T, and beta as a cloud
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    assert_true(scene.shared_geometry && !scene.pane_beta && scene.flash_return == 0);
    check_cloud(&scene.cloud[LAYER_BETA], 1, 0);
    assert_int_equal(scene.cloud[LAYER_T_F].n, 0);
    fs_scene_free(&scene);
    assert_int_equal(run(out, "2", "shared", NULL), 0);
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    assert_int_equal(scene.separation, SEPARATION_FLASHLESS);
    assert_false(fs_scene_lit(&scene));
    check_cloud(&scene.cloud[LAYER_R], 3, 0);
    for (int i = 0; i < scene.cloud[LAYER_T_N].n; i++) assert_true(scene.cloud[LAYER_T_N].field[CLOUD_GAINS][i] == 0);
    fs_scene_free(&scene);
    separation = "none";
    assert_int_equal(run(out, "2", "separate", NULL), 0);
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    assert_true(scene.shared_geometry && !scene.cloud[LAYER_BETA].n && !scene.cloud[LAYER_R].n);
    fs_scene_free(&scene);
    assert_int_equal(run(out, "2", "shared", NULL), 0);
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    check_cloud(&scene.cloud[LAYER_T_N], 3, 1);
    assert_int_equal(scene.cloud[LAYER_R].n, 0);
    assert_true(scene.pane.f0 == 0 && scene.pane.dimming == 0);
    fs_scene_free(&scene);
    separation = "full";
}

static void test_run(void **state)
{
    const char *out = *state;
    char *start = fs_file_path("%s/start", out), *R = fs_file_path("%s/start/R.ply", out);
    char *T = fs_file_path("%s/start/T_N.ply", out), *points = fs_file_path("%s/start/reflected.ply", out), *first,
         *second;
    size_t first_size, second_size;
    SmallViews views;
    MadeTexture texture_T, texture_R;
    Scene scene;
    assert_int_equal(made_capture(&views, &texture_T, &texture_R, NULL), 0);
    write_photos(out, &views);
    write_points(out, &views, POINTS);
    FsError err = {0};
    if (run(out, "1", "shared", &err) < 0) fail_msg("%s", err.message);
    assert_null(strstr(warned, "weak flash"));
    assert_true(fs_file_exists(points));
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    assert_true(scene.shared_geometry && scene.pane_beta && scene.extent > 0 && scene.flash_distance > 1);
    assert_true(fabs(scene.gain_color[1] - (double)MADE_ALPHA) < 0.4);
    check_cloud(&scene.cloud[LAYER_T_N], 3, 1);
    check_cloud(&scene.cloud[LAYER_R], 3, 0);
    assert_int_equal(scene.cloud[LAYER_T_F].n, 0);
    fs_scene_free(&scene);
    for (int k = 0; k < 2; k++) {
        const char *path = k ? R : T;
        assert_int_equal(fs_file_read(path, 1 << 24, &first, &first_size, NULL), 0);
        assert_int_equal(run(out, "3", "shared", NULL), 0);
        assert_int_equal(fs_file_read(path, 1 << 24, &second, &second_size, NULL), 0);
        assert_int_equal(first_size, second_size);
        assert_memory_equal(first, second, first_size);
        free(first);
        free(second);
    }
    assert_int_equal(run(out, "2", "separate", NULL), 0);
    assert_int_equal(fs_scene_read(&scene, start, NULL), 0);
    assert_false(scene.shared_geometry || scene.pane_beta);
    check_cloud(&scene.cloud[LAYER_T_N], 3, 0);
    check_cloud(&scene.cloud[LAYER_T_F], 3, 0);
    check_cloud(&scene.cloud[LAYER_R], 3, 0);
    check_cloud(&scene.cloud[LAYER_BETA], 1, 0);
    const Cloud *T_N = &scene.cloud[LAYER_T_N], *T_F = &scene.cloud[LAYER_T_F]; // begin in the photos' colours, both
    assert_memory_equal(T_N->field[CLOUD_COLORS], T_F->field[CLOUD_COLORS], sizeof(float) * 3 * (size_t)T_N->n);
    fs_scene_free(&scene);
    check_comparisons(out, start);
    fs_small_views_free(&views);
    free(start);
    free(R);
    free(T);
    free(points);
}

static void test_weak_flash(void **state)
{
    const char *out = *state;
    SmallViews views;
    MadeTexture texture_T, texture_R;
    assert_int_equal(made_capture(&views, &texture_T, &texture_R, NULL), 0);
    for (int i = 0; i < views.n; i++) // all photos alike: the flash does nothing
        for (int p = 0; p < MADE_WIDTH * MADE_HEIGHT * 3 && views.view[i].flash; p++)
            views.view[i].photo.px[p] = made_photo_at(&views.view[i].camera, &texture_T, &texture_R, false, p % 3,
                                                      p / 3 % MADE_WIDTH + 0.5, (double)(p / 3 / MADE_WIDTH) + 0.5);
    write_photos(out, &views);
    write_points(out, &views, POINTS);
    assert_int_equal(run(out, "2", "shared", NULL), 0);
    assert_non_null(strstr(warned, "flash")); // it says so, and still makes a start
    fs_small_views_free(&views);
}

static void test_refuses(void **state)
{
    const char *out = *state;
    SmallViews views;
    MadeTexture texture_T, texture_R;
    FsError err = {0};
    assert_int_equal(run(out, "2", "shared", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "views.json"));
    assert_int_equal(made_capture(&views, &texture_T, &texture_R, NULL), 0);
    write_photos(out, &views);
    write_points(out, &views, 5);
    assert_int_equal(run(out, "2", "shared", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "5 points"));
    write_points(out, &views, POINTS);
    for (int i = 0; i < views.n; i++) views.view[i].flash = true;
    write_photos(out, &views);
    assert_int_equal(run(out, "2", "shared", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "0 without"));
    fs_small_views_free(&views);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_run, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_weak_flash, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_refuses, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

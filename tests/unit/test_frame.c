// Camera models from another frame than the capture's: moved into it, or left alone.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>

#include "base/rng.h"
#include "model/similarity.h"
#include "render/view_list.h"

#define PHOTOS 9

static void take_log(void *user, FsLogLevel level, const char *message)
{
    snprintf(user, 400, "%d %s", level, message);
}

static Camera random_camera(Rng *rng)
{
    double q[4] = {1, 0.1 * fs_rng_normal(rng), 0.1 * fs_rng_normal(rng), 0.1 * fs_rng_normal(rng)}, r[9];
    Camera camera = {.width = 60, .height = 40, .fx = 50, .fy = 50, .cx = 30, .cy = 20};
    fs_camera_quat_to_rotation(q, r);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) camera.w2c[4 * i + k] = r[3 * i + k];
        camera.w2c[4 * i + 3] = fs_rng_normal(rng);
    }
    return camera;
}

// PHOTOS posed photos, and the same seen from the other frame with two views more.
static void make(Dataset *photos, Dataset *views, const Similarity *move)
{
    Rng rng = fs_rng_new(5);
    *photos = *views = (Dataset){0};
    for (int i = 0; i < PHOTOS + 2; i++) {
        char name[20];
        snprintf(name, sizeof name, "v%02d", i);
        View view = {.name = name, .camera = random_camera(&rng)};
        if (i < PHOTOS) assert_int_equal(fs_dataset_append(photos, &view, NULL), 0);
        if (move) view.camera = fs_similarity_camera(move, &view.camera);
        assert_int_equal(fs_dataset_append(views, &view, NULL), 0);
    }
}

static double worst_difference(const Dataset *views)
{
    Rng rng = fs_rng_new(5);
    double worst = 0;
    for (int i = 0; i < PHOTOS + 2; i++) {
        Camera truth = random_camera(&rng);
        for (int k = 0; k < 12; k++) worst = fmax(worst, fabs(views->view[i].camera.w2c[k] - truth.w2c[k]));
    }
    return worst;
}

static void another_frame_is_undone(void **state)
{
    (void)state;
    char line[400] = "";
    Log log = {.log = take_log, .user = line};
    const double q[4] = {0.3, -0.5, 0.2, 0.7};
    Similarity move = {.scale = 3.7, .t = {10, -20, 5}};
    fs_camera_quat_to_rotation(q, move.r);
    Dataset photos, views;
    make(&photos, &views, &move);
    assert_true(worst_difference(&views) > 1);
    assert_int_equal(fs_frame_align(&views, &photos, "model", false, &log, NULL), 0);
    assert_true(worst_difference(&views) < 1e-9); // also of the views that only the model has
    assert_non_null(strstr(line, "1 model: moved into the frame of the photos by 9 views"));
    fs_dataset_free(&photos);
    fs_dataset_free(&views);
}

static void the_same_frame_is_left_alone(void **state)
{
    (void)state;
    char line[400] = "";
    Log log = {.log = take_log, .user = line};
    Dataset photos, views;
    make(&photos, &views, NULL);
    views.view[3].camera.w2c[3] += 0.5; // one view moved by bundle adjustment or by hand
    Dataset before = {0};
    for (int i = 0; i < views.n; i++) {
        views.view[i].camera.w2c[7] += 1e-3;
        assert_int_equal(fs_dataset_append(&before, &views.view[i], NULL), 0);
    }
    assert_int_equal(fs_frame_align(&views, &photos, "model", false, &log, NULL), 0);
    for (int i = 0; i < views.n; i++)
        assert_memory_equal(&views.view[i].camera, &before.view[i].camera, sizeof(Camera));
    assert_string_equal(line, "");
    fs_dataset_free(&before);
    fs_dataset_free(&photos);
    fs_dataset_free(&views);
}

static void unrelated_poses_are_left_with_a_warning(void **state)
{
    (void)state;
    char line[400] = "";
    Log log = {.log = take_log, .user = line};
    Dataset photos, views;
    make(&photos, &views, NULL);
    for (int i = 0; i < PHOTOS / 2; i++) { // names swapped about
        Camera c = views.view[i].camera;
        views.view[i].camera = views.view[PHOTOS - 1 - i].camera;
        views.view[PHOTOS - 1 - i].camera = c;
    }
    Camera first = views.view[0].camera;
    assert_int_equal(fs_frame_align(&views, &photos, "model", false, &log, NULL), 0);
    assert_memory_equal(&views.view[0].camera, &first, sizeof first);
    assert_true(line[0] == '0' + FS_LOG_WARN);
    FsError err = {0}; // they would overwrite the photos' renders
    assert_int_equal(fs_frame_align(&views, &photos, "model", true, &log, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "disagree with those in views.json"));
    assert_non_null(strstr(err.message, "-o DIR"));
    Dataset one = {0}; // no frame can be told from it, but that it is another view
    assert_int_equal(fs_dataset_append(&one, &views.view[0], NULL), 0);
    assert_int_equal(fs_frame_align(&one, &photos, "model", true, &log, &err), FS_ERR_INPUT);
    one.view[0].camera = photos.view[0].camera;
    assert_int_equal(fs_frame_align(&one, &photos, "model", true, &log, &err), 0);
    fs_dataset_free(&one);
    fs_dataset_free(&photos);
    photos = (Dataset){0}; // nothing in common: nothing to tell by
    line[0] = 0;
    assert_int_equal(fs_frame_align(&views, &photos, "model", false, &log, NULL), 0);
    assert_memory_equal(&views.view[0].camera, &first, sizeof first);
    fs_dataset_free(&views);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(another_frame_is_undone),
        cmocka_unit_test(the_same_frame_is_left_alone),
        cmocka_unit_test(unrelated_poses_are_left_with_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

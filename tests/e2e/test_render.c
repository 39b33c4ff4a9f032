// The render stage on a small scene made here: a wall of Gaussians seen by eight cameras.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>

#include "../unit/temp_dir.h"
#include "base/owned.h"
#include "image/tone.h"
#include "model/dataset.h"
#include "model/scene.h"
#include "model/rendered_from.h"

#define VIEWS 8
#define WIDTH 48
#define HEIGHT 32

typedef struct Capture {
    char *out;
    FsSettings *settings;
    bool cancel;
    char log[4000];
} Capture;

// A wall at z = distance, spacing apart, in one colour (tone-mapped), opaque.
static void make_wall(Cloud *cloud, int colors, float distance, float value)
{
    const int side = 21;
    assert_int_equal(fs_cloud_new(cloud, side * side, colors, 0, NULL), 0);
    for (int i = 0; i < side * side; i++) {
        float *mean = cloud->field[CLOUD_MEANS] + 3 * i, *scale = cloud->field[CLOUD_SCALES] + 3 * i;
        mean[0] = 0.2f * distance * (float)(i % side - side / 2) * 0.5f;
        mean[1] = 0.2f * distance * (float)(i / side - side / 2) * 0.5f;
        mean[2] = distance;
        scale[0] = scale[1] = logf(0.12f * distance);
        scale[2] = logf(0.001f * distance);
        cloud->field[CLOUD_QUATS][4 * i] = 1;
        cloud->field[CLOUD_OPACITIES][i] = 6;
        for (int c = 0; c < colors; c++) cloud->field[CLOUD_COLORS][colors * i + c] = value;
    }
}

static void make_scene(const char *out, double metres_per_unit)
{
    Scene scene = {.extent = 0.5, .metres_per_unit = metres_per_unit, .flash_distance = 1};
    make_wall(&scene.cloud[LAYER_T_N], 3, 2, fs_tone_encode(0.1f));
    make_wall(&scene.cloud[LAYER_T_F], 3, 2, fs_tone_encode(0.3f));
    make_wall(&scene.cloud[LAYER_R], 3, 4, fs_tone_encode(0.2f));
    make_wall(&scene.cloud[LAYER_BETA], 1, 2, 0);
    char *dir = fs_file_path("%s/clouds", out);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_scene_write(&scene, dir, NULL), 0);
    free(dir);
    fs_scene_free(&scene);
}

static void make_views(const char *out)
{
    Dataset data = {0};
    for (int i = 0; i < VIEWS; i++) {
        char name[20];
        snprintf(name, sizeof name, "IMG_%d", i + 1);
        View view = {.name = name,
                     .flash = i % 2,
                     .camera = {WIDTH,
                                HEIGHT,
                                50,
                                50,
                                WIDTH / 2.0,
                                HEIGHT / 2.0,
                                {1, 0, 0, -0.05 * i, 0, 1, 0, 0.01 * (i % 3), 0, 0, 1, 0}}};
        assert_int_equal(fs_dataset_append(&data, &view, NULL), 0);
    }
    char *path = fs_file_path("%s/views.json", out);
    assert_int_equal(fs_dataset_write(&data, path, NULL), 0);
    free(path);
    fs_dataset_free(&data);
}

static void take_log(void *user, FsLogLevel level, const char *message)
{
    (void)level;
    Capture *capture = user;
    size_t n = strlen(capture->log);
    snprintf(capture->log + n, sizeof capture->log - n, "%s\n", message);
}

static bool is_cancelled(void *user)
{
    return ((Capture *)user)->cancel;
}

static int capture_setup(void **state)
{
    Capture *capture = calloc(1, sizeof *capture);
    void *dir;
    if (!capture || temp_dir_make(&dir) < 0) return -1;
    capture->out = dir;
    capture->settings = fs_settings_new();
    make_scene(capture->out, 0);
    make_views(capture->out);
    *state = capture;
    return 0;
}

static int capture_teardown(void **state)
{
    Capture *capture = *state;
    void *dir = capture->out;
    temp_dir_remove(&dir);
    fs_settings_free(capture->settings);
    free(capture);
    return 0;
}

static int render(Capture *capture, FsError *err)
{
    FsProject *project;
    FsCallbacks callbacks = {.log = take_log, .cancelled = is_cancelled, .user = capture};
    capture->log[0] = 0;
    int rc = fs_project_open(&project, capture->out, capture->settings, &callbacks, err);
    if (rc == 0) rc = fs_render(project, err);
    fs_project_close(project);
    return rc;
}

static void set(Capture *capture, const char *name, const char *value)
{
    assert_int_equal(fs_settings_set(capture->settings, name, value, NULL), 0);
}

static Image read(const Capture *capture, const char *name)
{
    char *path = fs_file_path("%s/%s", capture->out, name);
    Image image = {0};
    FsError err = {0};
    int rc = fs_file_has_ext(path, "tif") ? fs_tiff_read(path, &image, &err) : fs_png_read(path, &image, &err);
    if (rc < 0) fail_msg("%s", err.message);
    free(path);
    return image;
}

static double middle(const Capture *capture, const char *name, int width, int height)
{
    Image image = read(capture, name);
    assert_int_equal(image.width, width);
    assert_int_equal(image.height, height);
    double v = image.px[(height / 2 * width + width / 2) * image.channels];
    fs_image_free(&image);
    return v;
}

static int count(const Capture *capture, const char *dir)
{
    char *path = fs_file_path("%s/%s", capture->out, dir);
    FileList list;
    int n = fs_file_list(path, &list, NULL) < 0 ? -1 : list.n;
    fs_file_list_free(&list);
    free(path);
    return n;
}

static double encoded(double linear)
{
    return pow(linear, 0.22);
}

static void photos_are_rendered_in_the_agreed_encodings(void **state)
{
    Capture *capture = *state;
    make_scene(capture->out, 0.5);
    assert_int_equal(render(capture, NULL), 0);
    static const char *const layers[] = {"T_N", "T_F", "R", "R_scene", "beta", "I_N", "I_F", "depth_T", "depth_R"};
    for (int l = 0; l < 9; l++) {
        char dir[40];
        snprintf(dir, sizeof dir, "renders/%s", layers[l]);
        assert_int_equal(count(capture, dir), VIEWS);
    }
    double half_step = 0.51 / 255 + 0.004; // rounding, and what shines through the wall's last per mille
    assert_float_equal(middle(capture, "renders/T_N/IMG_1.png", WIDTH, HEIGHT), encoded(0.1), half_step);
    assert_float_equal(middle(capture, "renders/T_F/IMG_8.png", WIDTH, HEIGHT), encoded(0.3), half_step);
    assert_float_equal(middle(capture, "renders/R_scene/IMG_3.png", WIDTH, HEIGHT), encoded(0.2), half_step);
    double beta = middle(capture, "renders/beta/IMG_2.png", WIDTH, HEIGHT);
    assert_float_equal(beta, 0.5, 1e-3);
    assert_float_equal(middle(capture, "renders/R/IMG_2.png", WIDTH, HEIGHT), encoded(0.2 * beta), half_step);
    assert_float_equal(middle(capture, "renders/I_N/IMG_2.png", WIDTH, HEIGHT), encoded(0.1 + 0.2 * beta), half_step);
    assert_float_equal(middle(capture, "renders/I_F/IMG_2.png", WIDTH, HEIGHT), encoded(0.3 + 0.2 * beta), half_step);
    assert_float_equal(middle(capture, "renders/depth_T/IMG_1.png", WIDTH, HEIGHT) * 65535, 1000, 3);
    assert_float_equal(middle(capture, "renders/depth_R/IMG_1.png", WIDTH, HEIGHT) * 65535, 2000, 6);
    Image sheet = read(capture, "sheet.png"); // 4 views in 6 columns, without photos here
    assert_true(sheet.width > 5 * WIDTH && sheet.height >= 4 * HEIGHT);
    fs_image_free(&sheet);
    assert_non_null(strstr(capture->log, "lacks that photo"));
}

static void a_second_run_is_skipped(void **state)
{
    Capture *capture = *state;
    set(capture, "layers", "T_N,depth_T");
    assert_int_equal(render(capture, NULL), 0);
    assert_int_equal(count(capture, "renders"), 2 + 1); // and what they are rendered from
    assert_float_equal(middle(capture, "renders/depth_T/IMG_1.tif", WIDTH, HEIGHT), 2, 0.005); // scale unknown
    assert_int_equal(render(capture, NULL), 0);
    assert_non_null(strstr(capture->log, "skipped"));
    set(capture, "linear", "true");
    assert_int_equal(render(capture, NULL), 0);
    assert_null(strstr(capture->log, "skipped"));
    assert_float_equal(middle(capture, "renders/T_N/IMG_1.tif", WIDTH, HEIGHT), 0.1, 0.002);
    set(capture, "metres-per-unit", "0.25");
    assert_int_equal(render(capture, NULL), 0);
    assert_float_equal(middle(capture, "renders/depth_T/IMG_1.png", WIDTH, HEIGHT) * 65535, 500, 2);
    assert_int_equal(count(capture, "renders/depth_T"), VIEWS);
}

static void renders_of_an_earlier_training_go(void **state)
{
    Capture *capture = *state;
    set(capture, "layers", "T_N");
    assert_int_equal(render(capture, NULL), 0);
    char *old = fs_file_path("%s/renders/R/GONE.png", capture->out), *dir = fs_file_path("%s/renders/R", capture->out);
    char *notes = fs_file_path("%s/renders/R/notes.txt", capture->out);
    char *film = fs_file_path("%s/video/T.mp4", capture->out), *films = fs_file_path("%s/video", capture->out);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_file_mkdirs(films, NULL), 0);
    assert_int_equal(fs_file_write(old, "x", 1, NULL), 0);
    assert_int_equal(fs_file_write(film, "x", 1, NULL), 0);
    assert_int_equal(fs_file_write(notes, "x", 1, NULL), 0);
    set(capture, "force", "true");
    assert_int_equal(render(capture, NULL), 0);
    assert_int_equal(count(capture, "renders/R"), 2); // the same clouds: a render of other views may stay
    assert_true(fs_file_exists(film));
    for (int told = 0; told < 2; told++) { // by times where nothing tells of which clouds they are
        FilePath from = fs_file_at("%s/renders/rendered_from.json", capture->out);
        const struct timespec early[2] = {{1000000, 0}, {1000000, 0}};
        assert_int_equal(fs_file_mkdirs(films, NULL), 0);
        assert_int_equal(fs_file_write(old, "x", 1, NULL), 0);
        assert_int_equal(fs_file_write(film, "x", 1, NULL), 0);
        fs_owned_remove(from.text);
        if (told) assert_int_equal(fs_file_write(from.text, "{\"clouds\": \"1\"}", 15, NULL), 0);
        if (!told) assert_int_equal(utimensat(AT_FDCWD, old, early, 0), 0);
        if (!told) assert_int_equal(utimensat(AT_FDCWD, film, early, 0), 0);
        assert_int_equal(render(capture, NULL), 0);
        assert_false(fs_file_exists(old) || fs_file_exists(film));
    }
    assert_true(fs_file_exists(notes));
    assert_int_equal(count(capture, "renders/T_N"), VIEWS);
    free(old);
    free(dir);
    free(notes);
    free(film);
    free(films);
}

static void write_model(const char *path, int width, double k1)
{
    char text[2000];
    fs_file_mkdirs(path, NULL);
    char *cameras = fs_file_path("%s/cameras.txt", path), *images = fs_file_path("%s/images.txt", path);
    char *points = fs_file_path("%s/points3D.txt", path);
    int n = snprintf(text, sizeof text, "1 SIMPLE_RADIAL %d %d %g %g %g %g\n", width, width * 2 / 3, width * 50.0 / 48,
                     width / 2.0, width / 3.0, k1);
    remove(cameras), remove(images), remove(points);
    assert_int_equal(fs_file_write(cameras, text, (size_t)n, NULL), 0);
    n = snprintf(text, sizeof text, "1 1 0 0 0 -0.1 0 0 1 in/IMG_3.JPG\n\n2 1 0 0 0 0.02 0 0 1 TEST_01.png\n\n");
    assert_int_equal(fs_file_write(images, text, (size_t)n, NULL), 0);
    assert_int_equal(fs_file_write(points, "", 0, NULL), 0);
    free(cameras);
    free(images);
    free(points);
}

static void any_camera_model_is_rendered_at_the_working_size(void **state)
{
    Capture *capture = *state;
    char *model = fs_file_path("%s/model", capture->out), *dir = fs_file_path("%s/views", capture->out);
    write_model(model, 600, 0);
    set(capture, "cameras", model);
    set(capture, "output", dir);
    assert_int_equal(render(capture, NULL), 0);
    assert_int_equal(count(capture, "views/T_N"), 2);
    assert_float_equal(middle(capture, "views/I_N/TEST_01.png", WIDTH, HEIGHT), encoded(0.2), 0.01);
    assert_null(strstr(capture->log, "distortion"));
    Image from_model = read(capture, "views/T_N/IMG_3.png"); // the photo's own pose, written otherwise
    set(capture, "long-edge", "24");
    write_model(model, 600, 0.1);
    assert_int_equal(render(capture, NULL), 0);
    assert_non_null(strstr(capture->log, "2 of 2 cameras have lens distortion"));
    assert_float_equal(middle(capture, "views/I_N/TEST_01.png", 24, 16), encoded(0.2), 0.01);
    assert_int_equal(count(capture, "renders"), -1); // nowhere else
    assert_int_equal(count(capture, "warnings"), -1);
    set(capture, "cameras", "");
    set(capture, "output", "");
    set(capture, "long-edge", "48");
    assert_int_equal(render(capture, NULL), 0);
    Image from_photo = read(capture, "renders/T_N/IMG_3.png");
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) assert_float_equal(from_model.px[i], from_photo.px[i], 0.005);
    fs_image_free(&from_model);
    fs_image_free(&from_photo);
    free(model);
    free(dir);
}

static void a_spiral_makes_frames_and_films(void **state)
{
    Capture *capture = *state;
    set(capture, "path", "spiral");
    set(capture, "path-views", "7");
    set(capture, "layers", "T_N,R");
    assert_int_equal(render(capture, NULL), 0);
    assert_int_equal(count(capture, "path/T_N"), 7);
    assert_int_equal(count(capture, "path/R"), 7);
    assert_int_equal(count(capture, "video"), 4);
    assert_float_equal(middle(capture, "path/T_N/path_0004.png", WIDTH, HEIGHT), encoded(0.1), 0.01);
}

static void films_of_a_spiral_are_made_again_by_the_stage(void **state)
{
    Capture *capture = *state;
    set(capture, "path-views", "2");
    set(capture, "layers", "T_N");
    set(capture, "video", "true");
    assert_int_equal(render(capture, NULL), 0);
    assert_int_equal(render(capture, NULL), 0);
    assert_non_null(strstr(capture->log, "skipped"));
    set(capture, "path", "spiral");
    assert_int_equal(render(capture, NULL), 0);
    set(capture, "path", "none");
    assert_int_equal(render(capture, NULL), 0);
    assert_null(strstr(capture->log, "skipped"));
}

static void a_spiral_leaves_the_stage_done(void **state)
{
    Capture *capture = *state;
    set(capture, "path-views", "2");
    set(capture, "layers", "T_N");
    set(capture, "metres-per-unit", "2");
    assert_int_equal(render(capture, NULL), 0);
    set(capture, "metres-per-unit", "0");
    set(capture, "path", "spiral");
    assert_int_equal(render(capture, NULL), 0);
    assert_float_equal(fs_rendered_from_scale(fs_file_at("%s/renders", capture->out).text), 2, 0); // the page's
    set(capture, "path", "none");
    set(capture, "metres-per-unit", "2");
    assert_int_equal(render(capture, NULL), 0);
    assert_non_null(strstr(capture->log, "skipped"));
    // films go with the folder that says whose they are, whatever their times
    FilePath film = fs_file_at("%s/video/T.mp4", capture->out);
    const struct timespec early[2] = {{1000000, 0}, {1000000, 0}};
    assert_true(fs_file_exists(film.text));
    assert_int_equal(utimensat(AT_FDCWD, film.text, early, 0), 0);
    fs_owned_remove(fs_file_at("%s/path", capture->out).text);
    set(capture, "force", "true");
    assert_int_equal(render(capture, NULL), 0);
    assert_true(fs_file_exists(film.text));
}

static void wrong_requests_are_named(void **state)
{
    Capture *capture = *state;
    FsError err = {0};
    assert_int_equal(fs_settings_set(capture->settings, "layers", "T_N,T_X", &err), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "'T_X'"));
    assert_int_equal(fs_settings_set(capture->settings, "layers", "", &err), FS_ERR_USAGE);
    set(capture, "layers", "T_N");
    char *missing = fs_file_path("%s/no-model", capture->out);
    set(capture, "cameras", missing);
    assert_int_equal(render(capture, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, missing));
    set(capture, "path", "spiral");
    assert_int_equal(render(capture, &err), FS_ERR_USAGE);
    set(capture, "path", "none");
    set(capture, "cameras", "");
    char *views = fs_file_path("%s/views.json", capture->out);
    set(capture, "output", views); // a file where a folder should be
    assert_int_equal(render(capture, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, views));
    set(capture, "output", "");
    capture->cancel = true;
    assert_int_equal(render(capture, &err), FS_ERR_CANCELLED);
    capture->cancel = false;
    assert_int_equal(render(capture, &err), 0); // what was stopped is not marked done
    assert_null(strstr(capture->log, "skipped"));
    remove(views);
    fs_file_write(views, "{\"views\": []}", 13, NULL);
    set(capture, "force", "true");
    assert_true(render(capture, &err) < 0);
    assert_non_null(strstr(err.message, "views.json"));
    char *clouds = fs_file_path("%s/clouds", capture->out);
    fs_file_remove_tree(clouds);
    assert_int_equal(render(capture, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "train"));
    free(missing);
    free(views);
    free(clouds);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, capture_setup, capture_teardown)
int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(photos_are_rendered_in_the_agreed_encodings),
        TEST(a_second_run_is_skipped),
        TEST(renders_of_an_earlier_training_go),
        TEST(any_camera_model_is_rendered_at_the_working_size),
        TEST(a_spiral_makes_frames_and_films),
        TEST(films_of_a_spiral_are_made_again_by_the_stage),
        TEST(a_spiral_leaves_the_stage_done),
        TEST(wrong_requests_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

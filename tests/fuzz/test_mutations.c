// Every reader against damaged files: valid files are written, then cut, flipped, spliced and filled with absurd
// numbers, thousands of times from a fixed seed. A reader may take or refuse what it gets; it must not crash, and when
// it refuses, its message names the file in one line. The sanitizers' build makes this sharp.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/resource.h>

#include <cmocka.h>

#include "../unit/temp_dir.h"
#include "base/rng.h"
#include "image/exif.h"
#include "image/image.h"
#include "image/raw.h"
#include "model/cameras_file.h"
#include "model/project.h"
#include "model/scene.h"

#define ROUNDS 400
#define MAX_FILE (4 << 20)

// ---- damage ----

static void put_extreme(char *data, size_t n, Rng *rng)
{
    static const uint32_t values[] = {0,          1,          0x7f,       0xff,       0xffff,
                                      0x7fffffff, 0x80000000, 0xffffffff, 0x7fc00000, 0x01000000};
    uint32_t value = values[fs_rng_below(rng, 10)];
    if (n >= 4) memcpy(data + fs_rng_below(rng, (int)n - 3), &value, 4);
}

// Replaces one number of a text by something absurd; the file may grow.
static size_t put_word(char *data, size_t n, Rng *rng)
{
    static const char *const words[] = {"nan", "-1",  "99999999999999999999", "1e308", "-inf", "", "\"", "{", "]",
                                        "0",   "\n\n"};
    const char *word = words[fs_rng_below(rng, 11)];
    size_t at = n ? (size_t)fs_rng_below(rng, (int)n) : 0, end;
    while (at < n && !(data[at] >= '0' && data[at] <= '9')) at++;
    for (end = at; end < n && data[end] >= '0' && data[end] <= '9';) end++;
    memmove(data + at + strlen(word), data + end, n - end);
    memcpy(data + at, word, strlen(word));
    return n - (end - at) + strlen(word);
}

static size_t splice(char *data, size_t n, Rng *rng)
{
    if (n < 16) return n;
    size_t from = (size_t)fs_rng_below(rng, (int)n - 8), to = (size_t)fs_rng_below(rng, (int)n - 8), most = n - 8;
    size_t length = 1 + (size_t)fs_rng_below(rng, 64);
    if (from + length > most) length = 1;
    if (to + length > most) length = 1;
    memmove(data + to, data + from, length);
    if (fs_rng_below(rng, 2)) return n;
    memmove(data + to, data + to + length, n - to - length); // a hole instead
    return n - length;
}

// The room behind data is at least 64 bytes more than n.
static size_t damage(char *data, size_t n, Rng *rng)
{
    int times = 1 + fs_rng_below(rng, 3);
    while (times--) switch (fs_rng_below(rng, 6)) {
        case 0: n = n ? (size_t)fs_rng_below(rng, (int)n) : 0; break;
        case 1:
            for (int k = 1 + fs_rng_below(rng, 8); k && n; k--)
                data[fs_rng_below(rng, (int)n)] ^= (char)(1 << fs_rng_below(rng, 8));
            break;
        case 2: put_extreme(data, n, rng); break;
        case 3: put_extreme(data, n < 256 ? n : 256, rng); break; // headers more than bodies
        case 4: n = put_word(data, n, rng); break;
        default: n = splice(data, n, rng);
        }
    return n;
}

// ---- valid files ----

static void make_image(Image *image, int channels)
{
    Rng rng = fs_rng_new(1);
    assert_int_equal(fs_image_new(image, 40, 30, channels, NULL), 0);
    for (int i = 0; i < 40 * 30 * channels; i++) image->px[i] = fs_rng_uniform(&rng);
}

static int make_png(const char *path)
{
    Image image = {0};
    make_image(&image, 3);
    int rc = fs_png_write(path, &image, 16, NULL);
    fs_image_free(&image);
    return rc;
}

static int make_tiff(const char *path)
{
    Image image = {0};
    make_image(&image, 3);
    int rc = fs_tiff_write_float(path, &image, NULL);
    fs_image_free(&image);
    return rc;
}

// EXIF: one directory with orientation and a pointer to a second one with flash and exposure.
static const unsigned char exif_block[] = {
    'I',  'I',  42, 0, 8, 0, 0,    0,    2,   0, 0x12, 1, 3, 0, 1, 0, 0, 0, 6, 0, 0, 0, // Orientation
    0x69, 0x87, 4,  0, 1, 0, 0,    0,    38,  0, 0,    0,                               // ExifIFD
    0,    0,    0,  0, 2, 0, 0x09, 0x92, 3,   0, 1,    0, 0, 0, 9, 0, 0, 0,             // Flash
    0x9a, 0x82, 5,  0, 1, 0, 0,    0,    68,  0, 0,    0,                               // ExposureTime
    0,    0,    0,  0, 1, 0, 0,    0,    125, 0, 0,    0,
};

static int make_jpeg(const char *path)
{
    Image image = {0};
    make_image(&image, 3);
    int rc = fs_jpeg_write(path, &image, 90, exif_block, sizeof exif_block, NULL);
    fs_image_free(&image);
    return rc;
}

static int make_raw(const char *path)
{
    char *data;
    size_t size;
    int rc = fs_file_read(PHOTOS "/flash.dng", MAX_FILE, &data, &size, NULL);
    if (rc == 0) rc = fs_file_write(path, data, size, NULL);
    free(data);
    return rc;
}

static void make_cloud(Cloud *cloud)
{
    Rng rng = fs_rng_new(2);
    assert_int_equal(fs_cloud_new(cloud, 20, 3, 1, NULL), 0);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < 20 * cloud->width[f]; i++) cloud->field[f][i] = fs_rng_normal(&rng);
}

static int make_ply(const char *path)
{
    Cloud cloud = {0};
    make_cloud(&cloud);
    int rc = fs_cloud_ply_write(&cloud, path, NULL);
    fs_cloud_free(&cloud);
    return rc;
}

static int make_scene(const char *path)
{
    Scene scene = {
        .shared_geometry = true, .pane_beta = true, .pane = {{0, 0, 1}, 0.1}, .extent = 1, .flash_distance = 1};
    for (int k = 0; k < 3; k++) scene.gain_color[k] = 1;
    make_cloud(&scene.cloud[LAYER_T_N]);
    make_cloud(&scene.cloud[LAYER_R]);
    int rc = fs_scene_write(&scene, path, NULL);
    fs_scene_free(&scene);
    return rc;
}

static int make_views(const char *path)
{
    Dataset dataset = {0};
    View view = {.flash = true, .camera = {640, 480, 500, 500, 320, 240, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
    char name[3] = "a1";
    for (view.name = name; name[1] < '6'; name[1]++) assert_int_equal(fs_dataset_append(&dataset, &view, NULL), 0);
    int rc = fs_dataset_write(&dataset, path, NULL);
    fs_dataset_free(&dataset);
    return rc;
}

static int make_transforms(const char *path)
{
    static const char text[] =
        "{\"fl_x\": 500, \"fl_y\": 500, \"cx\": 320, \"cy\": 240, \"w\": 640, \"h\": 480, \"k1\": 0.01, \"frames\": ["
        "{\"file_path\": \"images/a.png\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]},"
        "{\"file_path\": \"images/b.png\", \"transform_matrix\": [[1,0,0,1],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}]}";
    return fs_file_write(path, text, sizeof text - 1, NULL);
}

static int make_model(const char *dir, bool binary)
{
    ColmapModel model = {0};
    Camera pinhole = {640, 480, 500, 500, 320, 240, {0}};
    ColmapCamera *camera = fs_colmap_model_add_camera(&model, NULL);
    *camera = (ColmapCamera){.id = 1, .lens = fs_lens_from_camera(&pinhole)};
    for (uint32_t i = 1; i <= 3; i++) {
        static const char *const names[] = {"folder/a.jpg", "folder/b.jpg", "c.jpg"};
        ColmapImage *image = fs_colmap_model_add_image(&model, names[i - 1], NULL);
        image->id = i, image->camera_id = 1, image->quat[0] = 1, image->t[2] = i;
        for (int k = 0; k < 4; k++)
            fs_colmap_model_add_observation(&model, (ColmapObservation){10.0 * k, 20.0 * k, k < 3 ? k : -1}, NULL);
    }
    for (int i = 0; i < 3; i++) {
        ColmapPoint *point = fs_colmap_model_add_point(&model, NULL);
        point->id = i, point->xyz[2] = 1 + i;
        for (uint32_t k = 1; k <= 3; k++) fs_colmap_model_add_track(&model, (ColmapTrack){k, (uint32_t)i}, NULL);
    }
    fs_file_mkdirs(dir, NULL);
    int rc = fs_colmap_model_write(dir, &model, binary, NULL);
    fs_colmap_model_free(&model);
    return rc;
}

static int make_text_model(const char *dir)
{
    return make_model(dir, false);
}

static int make_binary_model(const char *dir)
{
    return make_model(dir, true);
}

static int make_mark(const char *out)
{
    static const char text[] =
        "{\"stage\": \"train\", \"settings\": {\"steps\": 10000, \"seed\": 1, \"beta\": \"pane\"}}";
    char *dir = fs_file_path("%s/done", out), *path = fs_file_path("%s/done/train.json", out);
    fs_file_mkdirs(dir, NULL);
    int rc = fs_file_write(path, text, sizeof text - 1, NULL);
    free(dir);
    free(path);
    return rc;
}

// ---- readers ----

static int read_png(const char *path, FsError *err)
{
    Image image = {0};
    int rc = fs_png_read(path, &image, err);
    fs_image_free(&image);
    return rc;
}

static int read_tiff(const char *path, FsError *err)
{
    Image image = {0};
    int rc = fs_tiff_read(path, &image, err);
    fs_image_free(&image);
    return rc;
}

static int read_jpeg(const char *path, FsError *err)
{
    Image image = {0};
    ExifInfo exif;
    assert_int_equal(fs_exif_read(path, &exif, NULL), 0);
    assert_true(exif.orientation >= 1 && exif.orientation <= 8);
    int rc = fs_jpeg_read(path, &image, err);
    fs_image_free(&image);
    return rc;
}

static int read_raw(const char *path, FsError *err)
{
    Image rgb = {0}, clipped = {0};
    RawInfo info;
    int rc = fs_raw_read_info(path, &info, err);
    if (rc == 0) rc = fs_raw_read(path, (double[3]){1, 1, 1}, false, &rgb, &clipped, err);
    fs_image_free(&rgb);
    fs_image_free(&clipped);
    return rc;
}

static void check_finite(const Cloud *cloud)
{
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < cloud->n * cloud->width[f]; i++) assert_true(isfinite(cloud->field[f][i]));
}

static int read_ply(const char *path, FsError *err)
{
    Cloud cloud = {0};
    int rc = fs_cloud_ply_read(&cloud, path, err);
    if (rc == 0) check_finite(&cloud);
    fs_cloud_free(&cloud);
    return rc;
}

static int read_scene(const char *path, FsError *err)
{
    Scene scene = {0};
    int rc = fs_scene_read(&scene, path, err);
    for (int l = 0; l < LAYERS && rc == 0; l++) check_finite(&scene.cloud[l]);
    fs_scene_free(&scene);
    return rc;
}

static int read_cameras(const char *path, FsError *err)
{
    CamerasFile file = {0};
    int rc = fs_cameras_file_read(path, &file, err);
    for (int i = 0; i < file.views.n && rc == 0; i++) {
        const Camera *camera = &file.views.view[i].camera;
        assert_true(camera->width > 0 && camera->height > 0 && camera->fx > 0 && camera->fy > 0);
        for (int k = 0; k < 12; k++) assert_true(isfinite(camera->w2c[k]));
    }
    fs_cameras_file_free(&file);
    return rc;
}

static int read_mark(const char *out, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    FsProject *project = NULL;
    assert_non_null(settings);
    assert_int_equal(fs_project_open(&project, out, settings, NULL, err), 0);
    fs_project_done(project, "train", FS_STAGE_TRAIN);
    fs_project_close(project);
    fs_settings_free(settings);
    return 0;
}

// ---- the loop ----

typedef struct Format {
    const char *name;     // of the file, or of the folder to make
    const char *files[4]; // in that folder, to damage one at a time; {NULL}: the file itself
    int (*make)(const char *path);
    int (*read)(const char *path, FsError *err);
} Format;

static void damage_file(const Format *format, const char *target, const char *file, uint64_t seed)
{
    char *data;
    size_t n;
    assert_int_equal(fs_file_read(file, MAX_FILE, &data, &n, NULL), 0);
    char *copy = malloc(n + 256);
    Rng rng = fs_rng_new(seed);
    int refused = 0;
    for (int round = 0; round < ROUNDS; round++) {
        memcpy(copy, data, n);
        remove(file); // writing over it would wait for the disk
        FILE *f = fopen(file, "wb");
        fwrite(copy, 1, damage(copy, n, &rng), f);
        fclose(f);
        FsError err = {0};
        int rc = format->read(target, &err);
        if (rc == 0) continue;
        refused++;
        assert_true(rc < 0 && err.code == rc);
        if (!strstr(err.message, format->name) && rc != FS_ERR_MEMORY)
            fail_msg("does not name the file: %s", err.message);
        if (strchr(err.message, '\n')) fail_msg("more than one line: %s", err.message);
    }
    print_message("%-40s %d of %d damaged ones refused\n", file + strlen(file) - strlen(strstr(file, format->name)),
                  refused, ROUNDS);
    assert_int_equal(fs_file_write(file, data, n, NULL), 0);
    FsError err = {0};
    if (format->read(target, &err) != 0) fail_msg("the sound file is refused: %s", err.message);
    free(copy);
    free(data);
}

static void test_format(void **state, const Format *format)
{
    char *target = fs_file_path("%s/%s", (char *)*state, format->name);
    assert_int_equal(format->make(target), 0);
    if (!format->files[0]) damage_file(format, target, target, 7);
    for (int i = 0; i < 4 && format->files[i]; i++) {
        char *file = fs_file_path("%s/%s", target, format->files[i]);
        damage_file(format, target, file, 7 + (uint64_t)i);
        free(file);
    }
    free(target);
}

#define FORMAT(name_, ...)                                                                                             \
    static void test_##name_(void **state)                                                                             \
    {                                                                                                                  \
        test_format(state, &(const Format){__VA_ARGS__});                                                              \
    }

FORMAT(png, "a.png", {NULL}, make_png, read_png)
FORMAT(tiff, "a.tif", {NULL}, make_tiff, read_tiff)
FORMAT(jpeg, "a.jpg", {NULL}, make_jpeg, read_jpeg)
FORMAT(raw, "a.dng", {NULL}, make_raw, read_raw)
FORMAT(ply, "a.ply", {NULL}, make_ply, read_ply)
FORMAT(scene, "clouds", {"model.json", "T_N.ply"}, make_scene, read_scene)
FORMAT(views, "views.json", {NULL}, make_views, read_cameras)
FORMAT(transforms, "transforms.json", {NULL}, make_transforms, read_cameras)
FORMAT(text_model, "text", {"cameras.txt", "images.txt", "points3D.txt"}, make_text_model, read_cameras)
FORMAT(binary_model, "binary", {"cameras.bin", "images.bin", "points3D.bin"}, make_binary_model, read_cameras)
FORMAT(mark, "out", {"done/train.json"}, make_mark, read_mark)

int main(void)
{
#ifndef __SANITIZE_ADDRESS__ // a header that lies must not take the machine's memory either
    setrlimit(RLIMIT_AS, &(struct rlimit){(rlim_t)2 << 30, (rlim_t)2 << 30});
#endif
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_png),        cmocka_unit_test(test_tiff),       cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_ply),        cmocka_unit_test(test_scene),      cmocka_unit_test(test_views),
        cmocka_unit_test(test_transforms), cmocka_unit_test(test_text_model), cmocka_unit_test(test_binary_model),
        cmocka_unit_test(test_mark),       cmocka_unit_test(test_raw),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}

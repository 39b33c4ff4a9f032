// Captures made by synth: the same for any number of threads, true to their own truth, as asked for, and readable.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <libexif/exif-data.h>
#include <libraw/libraw.h>

#include "base/process.h"
#include "image/image.h"
#include "image/tone.h"
#include "initialise/small_views.h"
#include "model/colmap_model.h"
#include "model/dataset.h"
#include "synth/sensor.h"
#include "synth/synth.h"
#include "temp_dir.h"

#define SEED "2" // the smallest scene

// Runs synth with small photos and the given settings (name, value, ..., NULL).
static int make(void **state, const char *name, FsError *err, ...)
{
    FsSettings *set = fs_settings_new();
    char *out = fs_file_path("%s/%s", (char *)*state, name);
    const char *const usual[] = {"seed", SEED, "width", "72", "height", "48", "photos", "4", "held-out", "1"};
    for (size_t i = 0; i < sizeof usual / sizeof *usual; i += 2)
        assert_int_equal(fs_settings_set(set, usual[i], usual[i + 1], NULL), 0);
    va_list ap;
    va_start(ap, err);
    for (const char *option; (option = va_arg(ap, const char *));)
        assert_int_equal(fs_settings_set(set, option, va_arg(ap, const char *), NULL), 0);
    va_end(ap);
    int rc = fs_synth_run(out, set, NULL, err);
    free(out);
    fs_settings_free(set);
    return rc;
}

static char *in(void **state, const char *name)
{
    return fs_file_path("%s/%s", (char *)*state, name);
}

static Image layer(void **state, const char *path) // linear
{
    char *full = in(state, path);
    Image image;
    assert_int_equal(fs_png_read(full, &image, NULL), 0);
    fs_tone_decode_image(&image);
    free(full);
    return image;
}

static double mean(const Image *image)
{
    double sum = 0;
    int n = image->width * image->height * image->channels;
    for (int i = 0; i < n; i++) sum += (double)image->px[i];
    return sum / n;
}

static void assert_same_file(void **state, const char *a, const char *b)
{
    char *path[2] = {in(state, a), in(state, b)}, *data[2];
    size_t size[2];
    for (int i = 0; i < 2; i++) assert_int_equal(fs_file_read(path[i], 1 << 24, &data[i], &size[i], NULL), 0);
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(data[0], data[1], size[0]);
    for (int i = 0; i < 2; i++) {
        free(path[i]);
        free(data[i]);
    }
}

static void test_threads(void **state)
{
    static const char *const folders[] = {"capture/raw",   "capture/jpeg",  "truth/T_N",   "truth/T_F",
                                          "truth/R",       "truth/I_N",     "truth/I_F",   "truth/beta",
                                          "truth/depth_T", "truth/depth_R", "truth/sparse"};
    int files = 0;
    assert_int_equal(make(state, "one", NULL, "threads", "1", NULL), 0);
    assert_int_equal(make(state, "three", NULL, "threads", "3", NULL), 0);
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        char *dir = fs_file_path("%s/one/%s", (char *)*state, folders[i]);
        FileList list;
        assert_int_equal(fs_file_list(dir, &list, NULL), 0);
        files += list.n;
        for (int k = 0; k < list.n; k++) {
            char *a = fs_file_path("one/%s/%s", folders[i], list.name[k]);
            char *b = fs_file_path("three/%s/%s", folders[i], list.name[k]);
            assert_same_file(state, a, b);
            free(a);
            free(b);
        }
        fs_file_list_free(&list);
        free(dir);
    }
    assert_same_file(state, "one/truth/cameras.json", "three/truth/cameras.json");
    assert_true(files >= 4 + 4 + 3 + 5 + 4);
    assert_int_equal(make(state, "other", NULL, "seed", "7", NULL), 0); // another seed, another scene
    Image a = layer(state, "one/truth/T_N/TEST_01.png"), b = layer(state, "other/truth/T_N/TEST_01.png");
    double difference = 0;
    for (int i = 0; i < 72 * 48 * 3; i++) difference += fabs((double)(a.px[i] - b.px[i])) / (72 * 48 * 3);
    assert_true(difference > 0.02);
    fs_image_free(&a);
    fs_image_free(&b);
}

// The range of linear values that an 8-bit layer value stands for.
static void range(float linear, double *low, double *high)
{
    double coded = 255 * pow((double)linear, 0.22);
    *low = pow(fmax(coded - 0.501, 0) / 255, 1 / 0.22);
    *high = coded > 254.5 ? 1e9 : pow((coded + 0.501) / 255, 1 / 0.22);
}

static void test_equation(void **state) // I_N = T_N + R as exactly as the files can say
{
    assert_int_equal(make(state, "cap", NULL, NULL), 0);
    Image t = layer(state, "cap/truth/T_N/TEST_01.png"), r = layer(state, "cap/truth/R/TEST_01.png");
    Image i = layer(state, "cap/truth/I_N/TEST_01.png"), f = layer(state, "cap/truth/I_F/TEST_01.png");
    Image tf = layer(state, "cap/truth/T_F/TEST_01.png");
    double with = 0, without = 0; // R where nothing is clipped
    for (int k = 0; k < 72 * 48 * 3; k++) {
        double low[3], high[3];
        range(t.px[k], &low[0], &high[0]);
        range(r.px[k], &low[1], &high[1]);
        range(i.px[k], &low[2], &high[2]);
        assert_true(low[0] + low[1] <= high[2] && high[0] + high[1] >= low[2]);
        range(tf.px[k], &low[0], &high[0]);
        range(f.px[k], &low[2], &high[2]);
        assert_true(low[0] + low[1] <= high[2]); // with the flash, R may be brighter, not darker
        if (f.px[k] < 0.9f) {
            with += (double)(f.px[k] - tf.px[k]);
            without += (double)r.px[k];
        }
    }
    // as asked for: exposure, the mirrored layer's share, the flash's gain, what comes back by the room
    assert_in_range((int)(1000 * mean(&i)), 85, 140);
    assert_in_range((int)(1000 * mean(&r) / mean(&i)), 380, 520);
    assert_in_range((int)(1000 * (mean(&tf) - mean(&t)) / mean(&t)), 1200, 1800);
    assert_in_range((int)(1000 * with / without), 1010, 1055);
    fs_image_free(&t);
    fs_image_free(&r);
    fs_image_free(&i);
    fs_image_free(&f);
    fs_image_free(&tf);
}

// A RAW file as LibRaw sees it against the truth at the same view.
static void check_raw(void **state, const View *view)
{
    char *path = fs_file_path("%s/cap/capture/raw/%s.DNG", (char *)*state, view->name);
    char *t_name = fs_file_path("cap/truth/%s/%s.png", view->flash ? "T_F" : "T_N", view->name);
    char *r_name = fs_file_path("cap/truth/R/%s.png", view->name);
    libraw_data_t *raw = libraw_init(0);
    assert_int_equal(libraw_open_file(raw, path), 0);
    assert_int_equal(libraw_unpack(raw), 0);
    assert_int_equal(raw->sizes.width, 72);
    assert_int_equal(raw->sizes.height, 48);
    assert_int_equal(raw->color.maximum, SENSOR_WHITE);
    assert_int_equal((int)raw->color.black + (int)raw->color.cblack[0], SENSOR_BLACK);
    assert_true(fabsf(raw->color.cam_mul[0] / raw->color.cam_mul[1] - 2.1f) < 1e-3f);
    assert_true(fabsf(raw->color.cam_mul[2] / raw->color.cam_mul[1] - 1.5f) < 1e-3f);
    assert_true(fabsf(raw->other.iso_speed - 200) < 0.5f && fabsf(raw->other.shutter - 0.025f) < 1e-4f);
    assert_true(fabsf(raw->other.aperture - 5.6f) < 0.01f && fabsf(raw->other.focal_len - 23.9f) < 0.01f);
    Image t = layer(state, t_name), r = layer(state, r_name);
    const double neutral[3] = SENSOR_NEUTRAL;
    double seen[3] = {0}, expected[3] = {0};
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 72; x++) {
            int c = (y & 1) + (x & 1);
            assert_int_equal(libraw_COLOR(raw, y, x) == 3 ? 1 : libraw_COLOR(raw, y, x), c);
            const float *t_px = &t.px[(y * 72 + x) * 3], *r_px = &r.px[(y * 72 + x) * 3];
            if (fmaxf(t_px[c], r_px[c]) > 0.99f)
                continue; // a lamp: the truth's 8 bits end at 1, the sensor's red does not
            double value = raw->rawdata.raw_image[y * (int)raw->sizes.raw_pitch / 2 + x];
            seen[c] += (value - SENSOR_BLACK) / (SENSOR_WHITE - SENSOR_BLACK);
            expected[c] += fmin(neutral[c] * (double)(t_px[c] + r_px[c]), 1);
        }
    for (int c = 0; c < 3; c++) assert_true(fabs(seen[c] / expected[c] - 1) < (view->flash ? 0.03 : 0.012));
    libraw_close(raw);
    fs_image_free(&t);
    fs_image_free(&r);
    free(path);
    free(t_name);
    free(r_name);
}

static void check_exif(void **state, const View *view)
{
    char *path = fs_file_path("%s/cap/capture/jpeg/%s.JPG", (char *)*state, view->name), text[64];
    ExifData *exif = exif_data_new_from_file(path);
    assert_non_null(exif);
    ExifByteOrder order = exif_data_get_byte_order(exif);
    ExifContent *shot = exif->ifd[EXIF_IFD_EXIF];
    assert_int_equal(exif_get_short(exif_content_get_entry(shot, EXIF_TAG_FLASH)->data, order) & 1, view->flash);
    ExifRational time = exif_get_rational(exif_content_get_entry(shot, EXIF_TAG_EXPOSURE_TIME)->data, order);
    assert_true(time.numerator == 1 && time.denominator == 40);
    assert_int_equal(exif_get_short(exif_content_get_entry(shot, EXIF_TAG_ISO_SPEED_RATINGS)->data, order), 200);
    assert_int_equal(exif_get_short(exif_content_get_entry(shot, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM)->data, order), 39);
    exif_entry_get_value(exif_content_get_entry(shot, EXIF_TAG_FNUMBER), text, sizeof text);
    assert_string_equal(text, "f/5.6");
    exif_data_unref(exif);
    free(path);
}

static void check_exiftool(void **state, const View *view)
{
    char *raw = fs_file_path("%s/cap/capture/raw/%s.DNG", (char *)*state, view->name);
    char *jpeg = fs_file_path("%s/cap/capture/jpeg/%s.JPG", (char *)*state, view->name),
         *log = in(state, "exiftool.log"), *data;
    const char *const argv[] = {"exiftool", "-n", "-s3", "-Flash", "-ISO", "-Warning", "-Error", raw, jpeg, NULL};
    size_t size;
    remove(log);
    assert_int_equal(fs_process_run(argv, log, NULL, NULL), 0);
    assert_int_equal(fs_file_read(log, 1 << 16, &data, &size, NULL), 0);
    assert_int_equal(strstr(data, "arning") || strstr(data, "rror"), 0);
    const char *flash = view->flash ? "\n9\n200\n" : "\n16\n200\n";
    const char *first = strstr(data, flash);
    assert_non_null(first);
    assert_non_null(strstr(first + 1, flash)); // in both files
    free(data);
    free(raw);
    free(jpeg);
    free(log);
}

static void test_files(void **state)
{
    assert_int_equal(make(state, "cap", NULL, "photos", "8", NULL), 0);
    char *cameras = in(state, "cap/truth/cameras.json");
    Dataset set = {0};
    assert_int_equal(fs_dataset_read(&set, cameras, NULL), 0);
    assert_int_equal(set.n, 9);
    int flash = 0, with_truth = 0;
    for (int i = 0; i < set.n; i++) {
        const View *view = &set.view[i];
        if (view->held_out) continue;
        flash += view->flash;
        check_exif(state, view);
        if (fs_process_found("exiftool")) check_exiftool(state, view);
        char *truth = fs_file_path("%s/cap/truth/R/%s.png", (char *)*state, view->name);
        if (fs_file_exists(truth)) {
            check_raw(state, view);
            with_truth++;
        }
        free(truth);
    }
    assert_int_equal(flash, 4);
    assert_true(with_truth >= 2);
    fs_dataset_free(&set);
    free(cameras);
}

// The largest distance between the camera centres of cameras.json and of sparse, metres.
static double pose_error(void **state, const char *name)
{
    char *cameras = fs_file_path("%s/%s/truth/cameras.json", (char *)*state, name);
    char *sparse = fs_file_path("%s/%s/truth/sparse", (char *)*state, name);
    Dataset set = {0};
    ColmapModel model = {0};
    double worst = 0;
    assert_int_equal(fs_dataset_read(&set, cameras, NULL), 0);
    assert_int_equal(fs_colmap_model_read(sparse, &model, NULL), 0);
    assert_int_equal(model.n_images, set.n);
    for (int i = 0; i < set.n; i++) {
        char *stem = fs_file_stem(model.image[i].name);
        int k = fs_dataset_find(&set, stem);
        free(stem);
        assert_true(k >= 0);
        double r[9], exact[3], d2 = 0;
        fs_camera_centre(&set.view[k].camera, exact);
        fs_camera_quat_to_rotation(model.image[i].quat, r);
        for (int a = 0; a < 3; a++) {
            double c = 0;
            for (int b = 0; b < 3; b++) c -= r[3 * b + a] * model.image[i].t[b];
            d2 += (c - exact[a]) * (c - exact[a]);
        }
        worst = fmax(worst, sqrt(d2));
    }
    fs_dataset_free(&set);
    fs_colmap_model_free(&model);
    free(cameras);
    free(sparse);
    return worst;
}

static void test_hard(void **state)
{
    FsError err;
    assert_int_equal(make(state, "x", &err, "hard", "frame,darkness", NULL), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "'darkness'"));
    assert_non_null(strstr(err.message, "weak-flash"));
    assert_non_null(strstr(err.message, "pose-noise"));
    assert_int_equal(make(state, "usual", NULL, "photos", "2", NULL), 0);
    assert_int_equal(make(state, "hard", NULL, "photos", "14", "hard",
                          "weak-flash,strong-reflection,few-photos,frame,flash-return,pose-noise", NULL),
                     0);
    char *last = in(state, "hard/capture/raw/IMG_0012.DNG"), *next = in(state, "hard/capture/raw/IMG_0013.DNG");
    assert_true(fs_file_exists(last) && !fs_file_exists(next));
    free(last);
    free(next);
    assert_true(pose_error(state, "usual") < 1e-6);
    double error = pose_error(state, "hard");
    assert_true(error > 5e-4 && error < 0.02);
    Image t = layer(state, "hard/truth/T_N/TEST_01.png"), tf = layer(state, "hard/truth/T_F/TEST_01.png");
    Image i = layer(state, "hard/truth/I_N/TEST_01.png"), f = layer(state, "hard/truth/I_F/TEST_01.png");
    Image r = layer(state, "hard/truth/R/TEST_01.png"), beta = layer(state, "hard/truth/beta/TEST_01.png");
    assert_in_range((int)(1000 * mean(&r) / mean(&i)), 520, 680);
    assert_in_range((int)(1000 * (mean(&tf) - mean(&t)) / mean(&t)), 230, 370);
    assert_in_range((int)(1000 * (mean(&f) - mean(&tf)) / mean(&r)), 1040, 1115);
    int bare = 0;
    for (int k = 0; k < 72 * 48; k++)
        if (beta.px[k] == 0) bare++;
    assert_in_range(bare, 72 * 48 / 100, 72 * 48 / 2); // the frame mirrors nothing
    fs_image_free(&t);
    fs_image_free(&tf);
    fs_image_free(&i);
    fs_image_free(&f);
    fs_image_free(&r);
    fs_image_free(&beta);
}

// Of the points that one view sees of a scene at its depth, in another view's picture, the share that is at its depth.
static double depth_agrees(void **state, const char *scene, const Dataset *cameras)
{
    Image depth[2];
    const Camera *camera[2] = {NULL, NULL};
    for (int k = 0; k < 2; k++) {
        char name[64];
        snprintf(name, sizeof name, "depths/truth/depth_%s/TEST_0%d.png", scene, k + 1);
        char *png = in(state, name);
        assert_int_equal(fs_png_read(png, &depth[k], NULL), 0);
        free(png);
        for (int i = 0; i < cameras->n; i++)
            if (strncmp(cameras->view[i].name, k ? "TEST_02" : "TEST_01", 7) == 0) camera[k] = &cameras->view[i].camera;
        assert_non_null(camera[k]);
    }
    int seen = 0, same = 0;
    for (int i = 0; i < 72 * 48; i++) {
        float xyz[3], z = 65.535f * depth[0].px[i];
        double pixel[2];
        if (!(z > 0)) continue;
        fs_small_views_unproject(camera[0], i % 72 + 0.5, i / 72 + 0.5, (double)z, xyz);
        double there = fs_camera_project(camera[1], (double[3]){xyz[0], xyz[1], xyz[2]}, pixel);
        if (!(pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < 72 && pixel[1] < 48)) continue;
        seen++;
        same += fabs((double)(65.535f * *fs_image_at(&depth[1], (int)pixel[0], (int)pixel[1])) / there - 1) < 0.02;
    }
    fs_image_free(&depth[0]);
    fs_image_free(&depth[1]);
    assert_true(seen > 72 * 48 / 3);
    return (double)same / seen;
}

// Both scenes stand still: the mirrored one, too, as one sees it behind the pane.
static void test_depths(void **state)
{
    Dataset cameras;
    assert_int_equal(make(state, "depths", NULL, "held-out", "2", NULL), 0);
    char *path = in(state, "depths/truth/cameras.json");
    assert_int_equal(fs_dataset_read(&cameras, path, NULL), 0);
    double t = depth_agrees(state, "T", &cameras), r = depth_agrees(state, "R", &cameras);
    print_message("depths agree: %.3f of T, %.3f of R\n", t, r);
    assert_true(t > 0.85 && r > 0.85);
    fs_dataset_free(&cameras);
    free(path);
}

// Share of the pixels whose light is under a limit.
static double share_below(const Image *image, float limit)
{
    size_t n = (size_t)image->width * (size_t)image->height * 3, below = 0;
    for (size_t i = 0; i < n; i++) below += image->px[i] < limit;
    return (double)below / (double)n;
}

static void test_dark(void **state)
{
    assert_int_equal(make(state, "lit", NULL, "photos", "2", NULL), 0);
    assert_int_equal(make(state, "dark", NULL, "photos", "2", "hard", "dark", NULL), 0);
    assert_int_equal(make(state, "wide", NULL, "photos", "2", "hard", "wide-path", NULL), 0);
    Image lit = layer(state, "lit/truth/T_N/TEST_01.png"), dark = layer(state, "dark/truth/T_N/TEST_01.png");
    assert_true(share_below(&dark, 0.01f) > 1.3 * share_below(&lit, 0.01f));
    Image wide = layer(state, "wide/truth/T_N/TEST_01.png"); // the same scene from another place
    assert_true(fabs(mean(&wide) / mean(&lit) - 1) < 0.5);
    assert_memory_not_equal(wide.px, lit.px, 4 * (size_t)lit.width * (size_t)lit.height * 3);
    fs_image_free(&lit);
    fs_image_free(&dark);
    fs_image_free(&wide);
}

// Of the pixels that have light without the flash, how many it adds nothing to.
static int unlit(void **state, const char *name, bool white)
{
    char n_name[64], f_name[64];
    snprintf(n_name, sizeof n_name, "%s/truth/T_N/TEST_01.png", name);
    snprintf(f_name, sizeof f_name, "%s/truth/T_F/TEST_01.png", name);
    Image n = layer(state, n_name), f = layer(state, f_name);
    int count = 0;
    for (int i = 0; i < 72 * 48; i++) {
        bool same = true, full = true;
        for (int c = 0; c < 3; c++) {
            same &= n.px[3 * i + c] == f.px[3 * i + c] && n.px[3 * i + c] > 0.02f;
            full &= n.px[3 * i + c] >= 1;
        }
        count += same && full == white;
    }
    fs_image_free(&n);
    fs_image_free(&f);
    return count;
}

// Behind the pane lamps shine, beyond white, and a screen, which is not; over a case and before a shelf.
static void test_lamps(void **state)
{
    static const char *const seeds[] = {"2", "1"};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(make(state, "usual", NULL, "photos", "2", "seed", seeds[i], NULL), 0);
        assert_int_equal(make(state, "lamps", NULL, "photos", "2", "seed", seeds[i], "hard", "lit", NULL), 0);
        assert_true(unlit(state, "usual", true) == 0 && unlit(state, "usual", false) < 10);
        assert_in_range(unlit(state, "lamps", true), 3, 300);
        assert_in_range(unlit(state, "lamps", false), 40, 600);
    }
}

static bool stop(void *user)
{
    (void)user;
    return true;
}

static void test_refusals(void **state)
{
    FsError err;
    FsSettings *set = fs_settings_new();
    assert_int_equal(fs_settings_set(set, "seed", SEED, NULL), 0);
    assert_int_equal(fs_settings_set(set, "width", "32", NULL) | fs_settings_set(set, "height", "32", NULL), 0);
    Log log = {.cancelled = stop};
    char *out = in(state, "cap"), *file = in(state, "file"), *below = in(state, "file/cap"), *own = in(state, "own");
    char *capture = in(state, "own/capture"), *photo = in(state, "own/capture/photo.jpg");
    char *taken = in(state, "cap/capture/raw/IMG_0001.DNG");
    assert_int_equal(fs_settings_set(set, "photos", "6", NULL) | fs_settings_set(set, "held-out", "0", NULL), 0);
    assert_int_equal(fs_synth_run(out, set, NULL, &err), 0);
    assert_int_equal(fs_synth_run(out, set, &log, &err), FS_ERR_CANCELLED);
    assert_true(fs_file_exists(taken)); // what was there stays until there are views to take its place
    free(taken);
    assert_int_equal(fs_file_write(file, "x", 1, NULL), 0);
    assert_int_equal(fs_synth_run(below, set, NULL, &err), FS_ERR_IO);
    assert_int_equal(fs_file_mkdirs(capture, NULL), 0);
    FILE *somebodys = fopen(photo, "w"); // a folder with what we did not write is not overwritten
    assert_non_null(somebodys);
    assert_int_equal(fclose(somebodys), 0);
    assert_int_equal(fs_synth_run(own, set, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, photo));
    fs_settings_free(set);
    free(out);
    free(file);
    free(below);
    free(own);
    free(capture);
    free(photo);
}

int main(void)
{
#define IN_FOLDER(name) cmocka_unit_test_setup_teardown(name, temp_dir_make, temp_dir_remove)
    const struct CMUnitTest tests[] = {
        IN_FOLDER(test_threads), IN_FOLDER(test_equation), IN_FOLDER(test_files),  IN_FOLDER(test_hard),
        IN_FOLDER(test_dark),    IN_FOLDER(test_lamps),    IN_FOLDER(test_depths), IN_FOLDER(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

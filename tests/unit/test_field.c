// The faults that synth gives a capture: in the photos, as truth/nuisance.json says, and nowhere else.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <libraw/libraw.h>

#include "base/json_file.h"
#include "image/bilinear.h"
#include "image/tone.h"
#include "model/colmap_model.h"
#include "synth/nuisance.h"
#include "synth/sensor.h"
#include "synth/synth.h"
#include "temp_dir.h"

enum { W = 96, H = 64, PHOTOS = 8 };

static FilePath in(void **state, const char *name)
{
    return fs_file_at("%s/%s", (char *)*state, name);
}

static const char *hard = "";

static int make(void **state, const char *name, const char *field, const char *threads, FsError *err)
{
    FsSettings *set = fs_settings_new();
    const char *const options[] = {"seed",     "2", "width",   "96",    "height", "64",  "photos", "8",
                                   "held-out", "1", "threads", threads, "field",  field, "hard",   hard};
    for (size_t i = 0; i < sizeof options / sizeof *options; i += 2)
        assert_int_equal(fs_settings_set(set, options[i], options[i + 1], NULL), 0);
    int rc = fs_synth_run(in(state, name).text, set, NULL, err);
    fs_settings_free(set);
    return rc;
}

static void make_ideal(void **state) // once
{
    if (fs_file_exists(in(state, "ideal/truth/cameras.json").text)) return;
    assert_int_equal(make(state, "ideal", "", "2", NULL), 0);
}

static json_t *nuisance_of(void **state, const char *capture)
{
    json_t *root = NULL;
    FilePath path = fs_file_at("%s/%s/truth/nuisance.json", (char *)*state, capture);
    assert_int_equal(fs_json_file_read(path.text, 1 << 20, &root, NULL), 0);
    assert_int_equal(json_array_size(json_object_get(root, "photos")), PHOTOS);
    return root;
}

static double of_photo(const json_t *root, int i, const char *name)
{
    const json_t *value = json_object_get(json_array_get(json_object_get(root, "photos"), (size_t)i), name);
    return json_is_boolean(value) ? json_is_true(value) : json_number_value(value);
}

static Mosaic raw_of(void **state, const char *capture, int i)
{
    FilePath path = fs_file_at("%s/%s/capture/raw/IMG_%04d.DNG", (char *)*state, capture, i + 1);
    libraw_data_t *raw = libraw_init(0);
    assert_int_equal(libraw_open_file(raw, path.text), 0);
    assert_int_equal(libraw_unpack(raw), 0);
    Mosaic m = {W, H, malloc(W * H * sizeof *m.px)};
    for (int y = 0; y < H; y++)
        memcpy(m.px + y * W, raw->rawdata.raw_image + y * (int)raw->sizes.raw_pitch / 2, W * sizeof *m.px);
    libraw_close(raw);
    return m;
}

static Image truth_of(void **state, const char *capture, const char *layer, int i) // linear
{
    FilePath path = fs_file_at("%s/%s/truth/%s/IMG_%04d.png", (char *)*state, capture, layer, i + 1);
    Image image;
    assert_int_equal(fs_png_read(path.text, &image, NULL), 0);
    fs_tone_decode_image(&image);
    return image;
}

static Image jpeg_of(void **state, const char *capture, int i)
{
    FilePath path = fs_file_at("%s/%s/capture/jpeg/IMG_%04d.JPG", (char *)*state, capture, i + 1);
    Image image;
    assert_int_equal(fs_jpeg_read(path.text, &image, NULL), 0);
    return image;
}

// Vignetting that the file tells, at a pixel.
static double kept(const json_t *root, int x, int y)
{
    const json_t *k = json_object_get(root, "vignetting");
    double r2 = (pow(x + 0.5 - 0.5 * W, 2) + pow(y + 0.5 - 0.5 * H, 2)) / (0.25 * (W * W + H * H)), sum = 1;
    for (size_t i = 0; i < 3; i++) sum += json_number_value(json_array_get(k, i)) * pow(r2, (double)i + 1);
    return sum;
}

// The light of a part of a photo over that which the truth's layers and the values in the file make.
static double seen_of_expected(void **state, const char *capture, const json_t *root, int i, bool corners)
{
    Mosaic raw = raw_of(state, capture, i);
    Image tn = truth_of(state, capture, "T_N", i), tf = truth_of(state, capture, "T_F", i);
    Image r = truth_of(state, capture, "R", i);
    double seen = 0, expected = 0, flash = of_photo(root, i, "flash");
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            int c = (y & 1) + (x & 1), p = 3 * (y * W + x) + c;
            bool out = fabs(x - 0.5 * W) > 0.3 * W && fabs(y - 0.5 * H) > 0.3 * H;
            if (c != 1 || out != corners || raw.px[y * W + x] > 16000 || fmaxf(tf.px[p], r.px[p]) > 0.98f) continue;
            double ambient =
                of_photo(root, i, "gain_T") * (double)tn.px[p] + of_photo(root, i, "gain_R") * (double)r.px[p];
            double lit = (double)(tf.px[p] - tn.px[p] + 0.03f * r.px[p]); // 0.03: comes back by the room
            expected += kept(root, x, y) *
                        (of_photo(root, i, "exposure_ambient") * ambient +
                         flash * of_photo(root, i, "exposure_flash") * of_photo(root, i, "gain_flash") * lit);
            seen += (double)(raw.px[y * W + x] - SENSOR_BLACK) / (SENSOR_WHITE - SENSOR_BLACK);
        }
    free(raw.px);
    fs_image_free(&tn);
    fs_image_free(&tf);
    fs_image_free(&r);
    return seen / expected;
}

static double spread(const json_t *root, const char *name) // standard deviation, of the mean
{
    double sum = 0, square = 0;
    for (int i = 0; i < PHOTOS; i++) {
        double v = of_photo(root, i, name) / PHOTOS;
        sum += v;
        square += v * v * PHOTOS;
    }
    return sqrt(square - sum * sum) / sum;
}

static void test_light(void **state) // the photos have the light that the file tells
{
    static const struct {
        const char *field, *varies[2];
        double least;
    } cases[] = {
        {"flash-jitter=0.2,drift=0.2", {"gain_flash", "gain_R"}, 0.06},
        {"shutter=0.5,vignetting=0.6,under=2,drift=0.2", {"exposure_flash", "gain_T"}, 0.03},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        assert_int_equal(make(state, "cap", cases[k].field, "2", NULL), 0);
        json_t *root = nuisance_of(state, "cap");
        for (int i = 0; i < 2; i++) assert_true(spread(root, cases[k].varies[i]) > cases[k].least);
        if (strstr(cases[k].field, "vignetting")) assert_true(kept(root, 0, 0) < 0.7);
        int told = 0;
        for (int i = 0; i < PHOTOS; i++) {
            if (!fs_file_exists(fs_file_at("%s/cap/truth/T_N/IMG_%04d.png", (char *)*state, i + 1).text)) continue;
            told += of_photo(root, i, "flash") > 0 ? 10 : 1;
            for (int corners = 0; corners < 2; corners++) {
                double ratio = seen_of_expected(state, "cap", root, i, corners);
                if (!(fabs(ratio - 1) < 0.025))
                    fail_msg("%s, photo %d, corners %d: %.3f", cases[k].field, i + 1, corners, ratio);
            }
        }
        assert_true(told == 22); // two of each lighting
        json_decref(root);
    }
}

static double of_curve(const json_t *root, double light)
{
    const json_t *curve = json_object_get(json_object_get(root, "jpeg"), "curve");
    assert_int_equal(json_array_size(curve), 64);
    double x0 = 0, y0 = 0;
    for (size_t i = 1; i < 64; i++) {
        const json_t *pair = json_array_get(curve, i);
        double x = json_number_value(json_array_get(pair, 0)), y = json_number_value(json_array_get(pair, 1));
        assert_true(x > x0 && y > y0); // monotone
        if (light <= x) return y0 + (y - y0) * (light - x0) / (x - x0);
        x0 = x;
        y0 = y;
    }
    return 1;
}

// The picture that the file's curve, matrix and the photo's white balance make of the RAW, without sharpening.
static void expect_jpeg(const json_t *root, int i, const Mosaic *raw, Image *image)
{
    const json_t *balance =
        json_object_get(json_array_get(json_object_get(root, "photos"), (size_t)i), "white_balance");
    const json_t *matrix = json_object_get(json_object_get(root, "jpeg"), "matrix");
    float wb[3];
    for (size_t c = 0; c < 3; c++) wb[c] = (float)json_number_value(json_array_get(balance, c));
    assert_int_equal(fs_sensor_develop(raw, wb, &(CameraStyle){0}, image, NULL), 0);
    for (int p = 0; p < W * H; p++) {
        double in[3], out[3] = {0};
        for (int c = 0; c < 3; c++) in[c] = (double)fs_tone_srgb_decode(image->px[3 * p + c]);
        for (int c = 0; c < 9; c++) out[c / 3] += json_number_value(json_array_get(matrix, (size_t)c)) * in[c % 3];
        for (int c = 0; c < 3; c++) image->px[3 * p + c] = (float)of_curve(root, fmax(out[c], 0));
    }
}

static void test_jpeg(void **state)
{
    assert_int_equal(make(state, "cap", "jpeg,white-balance=0.2", "2", NULL), 0);
    json_t *root = nuisance_of(state, "cap");
    double error = 0, plain_error = 0, sharp[2] = {0};
    for (int i = 0; i < PHOTOS; i++) {
        Mosaic raw = raw_of(state, "cap", i);
        Image seen = jpeg_of(state, "cap", i), expected = {0}, plain = {0};
        expect_jpeg(root, i, &raw, &expected);
        assert_int_equal(fs_sensor_develop(&raw, (float[]){1, 1, 1}, &(CameraStyle){0}, &plain, NULL), 0);
        double sum[3] = {0};
        for (int p = 0; p < W * H * 3; p++) {
            sum[0] += (double)seen.px[p] / (W * H * 3);
            sum[1] += (double)expected.px[p] / (W * H * 3);
            sum[2] += (double)plain.px[p] / (W * H * 3);
            if (p % (3 * W) < 3) continue;
            sharp[0] += fabs((double)(seen.px[p] - seen.px[p - 3]));
            sharp[1] += fabs((double)(expected.px[p] - expected.px[p - 3]));
        }
        error = fmax(error, fabs(sum[0] - sum[1]));
        plain_error = fmax(plain_error, fabs(sum[0] - sum[2]));
        free(raw.px);
        fs_image_free(&seen);
        fs_image_free(&expected);
        fs_image_free(&plain);
    }
    assert_true(error < 0.008); // the table is the curve
    assert_true(plain_error > 0.03);
    assert_true(sharp[0] > 1.15 * sharp[1]);
    json_decref(root);
}

static void test_gather(void **state) // gains and smear, on a bright dot in the light and one of the flash's
{
    (void)state;
    enum { N = 41 };
    PhotoNuisance photo = {.gain_flash = 0.5f, .gain_behind = 2, .gain_room = 3, .ambient = 1, .flash = 4};
    photo.blur_px = 8;
    photo.blur_degrees = 90;
    Nuisance u = {.photo = &photo, .n = 1};
    Traced traced = {0};
    Image light;
    for (int l = 0; l < TRACE_LAYERS; l++) assert_int_equal(fs_image_new(&traced.layer[l], N, N, 3, NULL), 0);
    for (int l = 0; l < TRACE_LAYERS; l++)
        for (int c = 0; c < 3; c++) fs_image_at(&traced.layer[l], 20, 20)[c] = l < TRACE_R_N ? 1 : 10;
    fs_image_at(&traced.layer[TRACE_T_F], 5, 5)[1] = 1; // the flash's alone
    assert_int_equal(fs_nuisance_gather(&u, 0, true, &traced, &light, NULL), 0);
    double sum = 0, across = 0, along = 0;
    for (int y = 15; y < 26; y++)
        for (int x = 15; x < 26; x++) {
            double v = (double)fs_image_at(&light, x, y)[0];
            sum += v;
            across += v * (x - 20) * (x - 20);
            along += v * (y - 20) * (y - 20);
        }
    assert_true(fabs(sum - 32) < 0.01); // 2 * 1 + 3 * 10
    assert_true(across / sum < 0.01 && fabs(along / sum - 8 * 8 / 12.0) < 0.4);
    assert_true(fabsf(fs_image_at(&light, 5, 5)[1] - 2) < 1e-4f && fs_image_at(&light, 5, 6)[1] == 0);
    for (int l = 0; l < TRACE_LAYERS; l++) fs_image_free(&traced.layer[l]);
    fs_image_free(&light);
}

static double sharpness(const Mosaic *m) // green differences, of the light
{
    double difference = 0, sum = 0;
    for (int y = 0; y < H - 1; y++)
        for (int x = 1 + (y & 1); x < W - 1; x += 2) {
            difference += fabs((double)m->px[y * W + x] - (double)m->px[(y + 1) * W + x - 1]);
            sum += (double)m->px[y * W + x] - SENSOR_BLACK;
        }
    return difference / sum;
}

static void test_blur(void **state)
{
    double ideal[2] = {0}, blurred[2] = {0};
    make_ideal(state);
    for (int k = 0; k < 2; k++) {
        assert_int_equal(make(state, "cap", k ? "shake=20" : "defocus=20", "2", NULL), 0);
        json_t *root = nuisance_of(state, "cap");
        int worst = 0;
        for (int i = 0; i < PHOTOS; i++) {
            worst += of_photo(root, i, "blur_px") > 20.0 * W / 600;
            Mosaic a = raw_of(state, "ideal", i), b = raw_of(state, "cap", i);
            ideal[k] += sharpness(&a);
            blurred[k] += sharpness(&b);
            free(a.px);
            free(b.px);
        }
        assert_int_equal(worst, k ? 2 : 0);
        assert_true(k || of_photo(root, 0, "focus_m") > 0.1);
        assert_true(blurred[k] < (k ? 0.85 : 0.97) * ideal[k]);
        json_decref(root);
    }
}

static void test_distortion(void **state) // undistorted with sparse_opencv's lens, the photos are the ideal ones
{
    FsError err;
    ColmapModel model = {0};
    make_ideal(state);
    assert_int_equal(make(state, "cap", "distortion=2", "2", NULL), 0);
    assert_int_equal(fs_colmap_model_read(in(state, "cap/truth/sparse_opencv").text, &model, &err), 0);
    assert_int_equal(model.n_images, PHOTOS + 1);
    const Lens *lens = &model.camera[0].lens;
    assert_int_equal(lens->model, LENS_OPENCV);
    for (int i = 0; i < PHOTOS; i++) {
        Image ideal = jpeg_of(state, "ideal", i), seen = jpeg_of(state, "cap", i);
        double straight = 0, bent = 0;
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++) {
                double ray[2] = {(x + 0.5 - lens->param[2]) / lens->param[0],
                                 (y + 0.5 - lens->param[3]) / lens->param[1]},
                       at[2];
                fs_lens_project(lens, ray, at);
                if (hypot(at[0] - x - 0.5, at[1] - y - 0.5) < 1) continue; // the middle
                float green = fs_image_at(&ideal, x, y)[1];
                straight += fabs((double)(fs_image_at(&seen, x, y)[1] - green));
                const Bilinear from = fs_bilinear_at(at[0] - 0.5, at[1] - 0.5, W, H);
                bent += fabs((double)(fs_bilinear_value(&from, seen.px, 3, 1) - green));
            }
        assert_true(straight > 0 && bent < 0.6 * straight);
        fs_image_free(&ideal);
        fs_image_free(&seen);
    }
    fs_colmap_model_free(&model);
}

static Image png_of(void **state, const char *path)
{
    Image image;
    assert_int_equal(fs_png_read(in(state, path).text, &image, NULL), 0);
    return image;
}

// The light in and outside of the figures, of that without them.
static void figure_light(void **state, int i, double *share, double *in_figure, double *outside)
{
    Image mask = png_of(state, fs_file_at("cap/truth/figures/IMG_%04d.png", i + 1).text);
    Mosaic a = raw_of(state, "ideal", i), b = raw_of(state, "cap", i);
    double sum[2][2] = {{0}}, n = 0;
    for (int p = 0; p < W * H; p++) {
        int inside = mask.px[p] > 0.5f;
        n += inside;
        sum[inside][0] += (double)a.px[p] - SENSOR_BLACK;
        sum[inside][1] += (double)b.px[p] - SENSOR_BLACK;
    }
    *share = n / (W * H);
    *in_figure = n > 0 ? sum[1][1] / sum[1][0] : 1;
    *outside = sum[0][1] / sum[0][0];
    free(a.px);
    free(b.px);
    fs_image_free(&mask);
}

static void test_figures(void **state)
{
    make_ideal(state);
    for (int k = 0; k < 2; k++) {
        int shown = 0;
        assert_int_equal(make(state, "cap", k ? "pedestrian" : "photographer", "2", NULL), 0);
        for (int i = 0; i < PHOTOS; i++) {
            double share, in_figure, outside;
            figure_light(state, i, &share, &in_figure, &outside);
            shown += share > 0.01;
            assert_true(share < 0.4 && fabs(outside - 1) < 0.02);
            assert_true(k || (share > 0.05 && in_figure < 0.97)); // dark, in every photo
        }
        assert_true(k ? shown >= 2 && shown < PHOTOS : shown == PHOTOS);
    }
}

static double sum_of(const Image *image, int channel, const Image *less)
{
    double sum = 0;
    for (size_t i = 0; i < fs_image_pixels(image); i++)
        sum += (double)(image->px[3 * i + (size_t)channel] - (less ? less->px[3 * i + (size_t)channel] : 0));
    return sum;
}

static void test_mirrored_flash(void **state) // white where it is, glare around it, in flash photos alone
{
    hard = "straight-on";
    assert_int_equal(make(state, "straight", "", "2", NULL), 0);
    assert_int_equal(make(state, "mirrored", "mirrored-flash", "2", NULL), 0);
    hard = "";
    json_t *root = nuisance_of(state, "mirrored");
    int seen = 0;
    for (int i = 0; i < PHOTOS; i++) {
        const json_t *photo = json_array_get(json_object_get(root, "photos"), (size_t)i);
        const json_t *at = json_object_get(photo, "mirrored_flash_px");
        bool flash = json_is_true(json_object_get(photo, "flash"));
        double x = json_number_value(json_array_get(at, 0)), y = json_number_value(json_array_get(at, 1));
        Mosaic plain = raw_of(state, "straight", i), raw = raw_of(state, "mirrored", i);
        bool inside = x >= 1 && y >= 1 && x < W - 1 && y < H - 1;
        seen += flash && inside;
        if (flash && inside) assert_true(raw.px[(int)y * W + (int)x] >= SENSOR_WHITE - 1);
        double near = 0, far = 0;
        int n = 0, m = 0;
        for (int p = 0; p < W * H; p++) {
            double r = hypot(p % W + 0.5 - x, p / W + 0.5 - y), more = raw.px[p] - plain.px[p];
            if (r > 3 && r < 5) near += more, n++;
            if (r > 25) far += more, m++;
        }
        if (flash && n > 20) assert_true(near / n > 100);
        if (m > 20) assert_true(fabs(far / m) < 12);
        if (!flash) assert_memory_equal(raw.px, plain.px, (size_t)(W * H) * sizeof *raw.px);
        free(plain.px);
        free(raw.px);
    }
    assert_true(seen >= 2);
    json_decref(root);
}

static void test_pane(void **state)
{
    static const char *const layers[] = {"T_N", "T_F", "R"};
    Image ideal[3], tinted[3];
    make_ideal(state);
    assert_int_equal(make(state, "cap", "tint=0.5", "2", NULL), 0); // seed 2: green
    for (int k = 0; k < 3; k++) {
        ideal[k] = truth_of(state, "ideal", layers[k], 0);
        tinted[k] = truth_of(state, "cap", layers[k], 0);
    }
    double once = sum_of(&tinted[0], 0, NULL) / sum_of(&ideal[0], 0, NULL) /
                  (sum_of(&tinted[0], 1, NULL) / sum_of(&ideal[0], 1, NULL));
    double twice = sum_of(&tinted[1], 0, &tinted[0]) / sum_of(&ideal[1], 0, &ideal[0]) /
                   (sum_of(&tinted[1], 1, &tinted[0]) / sum_of(&ideal[1], 1, &ideal[0]));
    assert_true(fabs(once - 0.5 / 0.85) < 0.02 && fabs(twice - once * once) < 0.05);
    assert_int_equal(make(state, "cap", "double-glazing", "2", NULL), 0);
    Image beta[2] = {png_of(state, "ideal/truth/beta/TEST_01.png"), png_of(state, "cap/truth/beta/TEST_01.png")};
    Image ghost = truth_of(state, "cap", "R", 0);
    double apart = 0, mean[2] = {0};
    for (size_t i = 0; i < fs_image_values(&ghost); i++) apart += fabs((double)(ghost.px[i] - ideal[2].px[i]));
    for (size_t i = 0; i < W * H; i++)
        for (int k = 0; k < 2; k++) mean[k] += (double)beta[k].px[i];
    assert_true(fabs(mean[1] / mean[0] - 1) < 0.1); // two weaker panes mirror as much together
    assert_true(apart > 0.04 * sum_of(&ideal[2], 1, NULL) &&
                fabs(sum_of(&ghost, 1, NULL) / sum_of(&ideal[2], 1, NULL) - 1) < 0.1);
    for (int k = 0; k < 3; k++) {
        fs_image_free(&ideal[k]);
        fs_image_free(&tinted[k]);
    }
    fs_image_free(&beta[0]);
    fs_image_free(&beta[1]);
    fs_image_free(&ghost);
}

static void test_dirt(void **state) // shines in the flash, hardly without
{
    double more[2] = {0};
    make_ideal(state);
    assert_int_equal(make(state, "cap", "dirt=0.05", "2", NULL), 0);
    json_t *root = nuisance_of(state, "cap");
    for (int i = 0; i < PHOTOS; i++) {
        Mosaic a = raw_of(state, "ideal", i), b = raw_of(state, "cap", i);
        for (int p = 0; p < W * H; p++) more[of_photo(root, i, "flash") > 0] += (double)b.px[p] - (double)a.px[p];
        free(a.px);
        free(b.px);
    }
    assert_true(more[1] > 4 * fabs(more[0]));
    json_decref(root);
}

static void same_folder(void **state, const char *other, const char *folder, bool same)
{
    FileList list;
    int different = 0;
    assert_int_equal(fs_file_list(fs_file_at("%s/one/%s", (char *)*state, folder).text, &list, NULL), 0);
    assert_true(list.n > 0);
    for (int k = 0; k < list.n; k++) {
        char *data[2];
        size_t size[2];
        for (int i = 0; i < 2; i++) {
            FilePath path = fs_file_at("%s/%s/%s/%s", (char *)*state, i ? other : "one", folder, list.name[k]);
            if (fs_file_read(path.text, 1 << 24, &data[i], &size[i], NULL) < 0) data[i] = strdup(""), size[i] = 0;
        }
        different += size[0] != size[1] || memcmp(data[0], data[1], size[0]) != 0;
        for (int i = 0; i < 2; i++) free(data[i]);
    }
    assert_int_equal(different, same ? 0 : list.n);
    fs_file_list_free(&list);
}

static void test_bits(void **state)
{
    static const char *const truth[] = {"truth/T_N", "truth/T_F",  "truth/R",       "truth/I_N",
                                        "truth/I_F", "truth/beta", "truth/depth_T", "truth/sparse"};
    assert_int_equal(make(state, "one", "all,tint=0,double-glazing=0", "1", NULL), 0);
    assert_int_equal(make(state, "two", "all,tint=0,double-glazing=0", "2", NULL), 0);
    same_folder(state, "two", "capture/raw", true);
    same_folder(state, "two", "capture/jpeg", true);
    same_folder(state, "two", "truth/sparse_opencv", true);
    same_folder(state, "two", "truth/figures", true);
    json_t *all = nuisance_of(state, "one"), *again = nuisance_of(state, "two");
    assert_true(json_equal(all, again));
    json_decref(again);
    assert_int_equal(make(state, "two", "drift,shake", "2", NULL), 0); // alone as together
    json_t *alone = nuisance_of(state, "two");
    for (int i = 0; i < PHOTOS; i++) {
        static const char *const names[] = {"gain_T", "gain_R", "blur_px", "blur_deg"};
        for (int k = 0; k < 4; k++) assert_true(of_photo(all, i, names[k]) == of_photo(alone, i, names[k]));
        assert_true(of_photo(alone, i, "gain_flash") == 1 && of_photo(alone, i, "exposure_flash") == 1);
    }
    json_decref(alone);
    json_decref(all);
    assert_int_equal(make(state, "two", "", "2", NULL),
                     0); // the truth is that of ideal photos, which differ from these
    same_folder(state, "ideal", "capture/raw", false);
    for (size_t i = 0; i < sizeof truth / sizeof *truth; i++) same_folder(state, "ideal", truth[i], true);
    FilePath path = in(state, "ideal/truth/nuisance.json");
    FsError err;
    char *data;
    size_t size;
    assert_int_not_equal(fs_file_read(path.text, 1 << 24, &data, &size, &err), 0);
}

static void test_list(void **state)
{
    static const char *const wrong[][2] = {{"fog", "'fog'"},       {"drift=x", "'x'"},        {"drift=-1", "0 to"},
                                           {"drift=nan", "'nan'"}, {"vignetting=2", "0.9"},   {"all=2", "no strength"},
                                           {"drift=", "''"},       {"pedestrian=2", "0 or 1"}};
    (void)state;
    Field field;
    FsError err;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_int_equal(fs_field_read(&field, wrong[i][0], &err), FS_ERR_USAGE);
        assert_non_null(strstr(err.message, wrong[i][1]));
    }
    assert_int_equal(fs_field_read(&field, "", &err), 0);
    assert_false(field.any);
    assert_int_equal(fs_field_read(&field, "all,shake=0,,drift=0.1", &err), 0);
    assert_true(field.any && field.strength[FIELD_SHAKE] == 0 && field.strength[FIELD_DRIFT] == 0.1f);
    for (int i = 0; i < FIELD_FAULTS; i++)
        assert_true((field.strength[i] > 0) == (i != FIELD_SHAKE && i != FIELD_MIRRORED_FLASH));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light), cmocka_unit_test(test_jpeg),           cmocka_unit_test(test_gather),
        cmocka_unit_test(test_blur),  cmocka_unit_test(test_distortion),     cmocka_unit_test(test_figures),
        cmocka_unit_test(test_pane),  cmocka_unit_test(test_dirt),           cmocka_unit_test(test_bits),
        cmocka_unit_test(test_list),  cmocka_unit_test(test_mirrored_flash),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}

// Images: area resize, orientation, tone curves, and the way through each file format and back.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/file.h"
#include "base/rng.h"
#include "image/half.h"
#include "image/sizes.h"
#include "image/tone.h"
#include "temp_dir.h"

static char *folder;

static Image noise(int width, int height, int channels, float low, float high)
{
    Image image;
    Rng rng = fs_rng_new(7);
    assert_int_equal(fs_image_new(&image, width, height, channels, NULL), 0);
    for (int i = 0; i < width * height * channels; i++) image.px[i] = fs_rng_range(&rng, low, high);
    return image;
}

static char *temp(const char *name)
{
    static char path[200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void assert_close(const Image *a, const Image *b, float tolerance)
{
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    assert_int_equal(a->channels, b->channels);
    for (int i = 0; i < a->width * a->height * a->channels; i++)
        if (!(fabsf(a->px[i] - b->px[i]) <= tolerance)) fail_msg("sample %d: %g and %g", i, a->px[i], b->px[i]);
}

static void test_limits(void **state)
{
    (void)state;
    Image image;
    FsError err;
    assert_int_equal(fs_image_new(&image, 0, 5, 3, &err), FS_ERR_INPUT);
    assert_int_equal(fs_image_new(&image, 70000, 5, 3, &err), FS_ERR_INPUT);
    assert_int_equal(fs_image_new(&image, 60000, 60000, 3, &err), FS_ERR_INPUT);
    assert_int_equal(fs_image_new(&image, 5, 5, 5, &err), FS_ERR_INPUT);
    assert_null(image.px);
    fs_image_free(&image);
}

// Against the definition: the integral of the input, as constant pixels, over each output pixel's square.
static void test_resize(void **state)
{
    (void)state;
    Image in = noise(17, 11, 3, -0.2f, 1), out;
    static const int sizes[][2] = {{17, 11}, {8, 5}, {16, 10}, {1, 1}, {5, 11}, {17, 3}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        int w = sizes[k][0], h = sizes[k][1];
        assert_int_equal(fs_image_resize_area(&in, w, h, &out, NULL), 0);
        for (int y = 0; y < h; y++)
            for (int x = 0; x < w; x++)
                for (int c = 0; c < 3; c++) {
                    double sum = 0, area = 0;
                    for (int j = 0; j < 11; j++)
                        for (int i = 0; i < 17; i++) {
                            double x0 = fmax(i, 17.0 * x / w), x1 = fmin(i + 1, 17.0 * (x + 1) / w);
                            double y0 = fmax(j, 11.0 * y / h), y1 = fmin(j + 1, 11.0 * (y + 1) / h);
                            double a = x1 > x0 && y1 > y0 ? (x1 - x0) * (y1 - y0) : 0;
                            sum += a * in.px[(j * 17 + i) * 3 + c], area += a;
                        }
                    assert_true(fabs(sum / area - out.px[(y * w + x) * 3 + c]) < 1e-6);
                }
        fs_image_free(&out);
    }
    fs_image_free(&in);
}

// Row by row to two sizes at once, some rows empty: what the whole picture gives.
static void test_sizes(void **state)
{
    (void)state;
    Image in = noise(17, 11, 3, -0.2f, 1), mask = noise(17, 11, 1, 0, 1), want;
    PhotoSizes sizes = {.n = 2, .size = {{.long_edge = 7}, {.long_edge = 0}}};
    memset(mask.px + 3 * 17, 0, 6 * 17 * sizeof *mask.px);
    assert_int_equal(fs_sizes_begin(&sizes, 17, 11, NULL), 0);
    for (int y = 0; y < 11; y++) fs_sizes_row(&sizes, in.px + y * 17 * 3, y >= 3 && y < 9 ? NULL : mask.px + y * 17);
    fs_sizes_end(&sizes);
    for (int k = 0; k < 4; k++) {
        const Image *got = k % 2 ? &sizes.size[k / 2].clipped : &sizes.size[k / 2].rgb;
        int width = k < 2 ? 7 : 17, height = k < 2 ? 5 : 11;
        assert_true(got->width == width && got->height == height);
        assert_int_equal(fs_image_resize_area(k % 2 ? &mask : &in, width, height, &want, NULL), 0);
        assert_memory_equal(got->px, want.px, (size_t)(width * height * want.channels) * sizeof(float));
        fs_image_free(&want);
    }
    fs_sizes_free(&sizes);
    fs_image_free(&in);
    fs_image_free(&mask);
}

// The eight ways of storing the letter F, from the EXIF standard's table.
static void test_orient(void **state)
{
    (void)state;
    static const char *const upright = "###"
                                       "#.."
                                       "##."
                                       "#..";
    static const struct {
        int width, height;
        const char *stored;
    } as[9] = {
        [1] = {3, 4,
               "###"
               "#.."
               "##."
               "#.."},
        [2] = {3, 4,
               "###"
               "..#"
               ".##"
               "..#"},
        [3] = {3, 4,
               "..#"
               ".##"
               "..#"
               "###"},
        [4] = {3, 4,
               "#.."
               "##."
               "#.."
               "###"},
        [5] = {4, 3,
               "####"
               "#.#."
               "#..."},
        [6] = {4, 3,
               "#..."
               "#.#."
               "####"},
        [7] = {4, 3,
               "...#"
               ".#.#"
               "####"},
        [8] = {4, 3,
               "####"
               ".#.#"
               "...#"},
    };
    for (int o = 1; o <= 8; o++) {
        Image image;
        assert_int_equal(fs_image_new(&image, as[o].width, as[o].height, 1, NULL), 0);
        for (int i = 0; i < 12; i++) image.px[i] = as[o].stored[i] == '#';
        assert_int_equal(fs_image_orient(&image, o, NULL), 0);
        assert_int_equal(image.width, 3);
        for (int i = 0; i < 12; i++)
            if ((image.px[i] == 1) != (upright[i] == '#')) fail_msg("orientation %d, pixel %d", o, i);
        fs_image_free(&image);
    }
}

static void test_tone(void **state)
{
    (void)state;
    assert_true(fs_tone_encode(-1) == 0 && fs_tone_encode(0) == 0 && fs_tone_encode(1) == 1);
    assert_true(fabsf(fs_tone_encode(0.18f) - 0.68575f) < 1e-4f);
    assert_true(fabsf(fs_tone_srgb_encode(0.5f) - 0.735357f) < 1e-5f);
    assert_true(fabsf(fs_tone_srgb_encode(0.001f) - 0.01292f) < 1e-6f);
    for (float x = 0; x < 1.5f; x += 0.01f) {
        assert_true(fabsf(fs_tone_decode(fs_tone_encode(x)) - x) < 2e-6f);
        assert_true(fabsf(fs_tone_srgb_decode(fs_tone_srgb_encode(x)) - x) < 2e-6f);
        assert_true(fs_tone_pleasant(x + 0.01f, 3) > fs_tone_pleasant(x, 3));
    }
    assert_true(fs_tone_pleasant(1e9f, 1) <= 1 && fs_tone_pleasant(NAN, 1) == 0);
    Image image = noise(40, 40, 3, 0, 0.01f);
    float exposure = fs_tone_pleasant_exposure(&image, 1); // the brightest of three is below cbrt(.95) of the range
    assert_true(fabsf(exposure * 0.01f * 0.983f - 0.7f) < 0.02f);
    fs_image_free(&image);
}

static void test_png(void **state)
{
    (void)state;
    for (int channels = 1; channels <= 3; channels += 2)
        for (int bits = 8; bits <= 16; bits += 8) {
            Image a = noise(13, 7, channels, 0, 1), b;
            assert_int_equal(fs_png_write(temp("a.png"), &a, bits, NULL), 0);
            assert_int_equal(fs_png_read(temp("a.png"), &b, NULL), 0);
            assert_close(&a, &b, 0.5001f / (bits == 8 ? 255 : 65535));
            fs_image_free(&a);
            fs_image_free(&b);
        }
}

static void test_tiff(void **state)
{
    (void)state;
    for (int channels = 1; channels <= 3; channels += 2) {
        Image a = noise(45, 77, channels, -1, 3), b;
        assert_int_equal(fs_tiff_write_float(temp("a.tif"), &a, NULL), 0);
        assert_int_equal(fs_tiff_read(temp("a.tif"), &b, NULL), 0);
        assert_close(&a, &b, 0); // exact
        fs_image_free(&b);
        assert_int_equal(fs_tiff_write_half(temp("a.tif"), &a, NULL), 0);
        assert_int_equal(fs_tiff_read(temp("a.tif"), &b, NULL), 0);
        assert_close(&a, &b, 0x1p-10f); // 11 bits of what is below 4
        fs_image_free(&a);
        fs_image_free(&b);
    }
}

static void test_half(void **state)
{
    (void)state;
    for (uint32_t h = 0; h < 0x10000; h++) {
        float f = half_to_float((uint16_t)h), next = half_to_float((uint16_t)(h + 1));
        if ((h & 0x7c00) == 0x7c00) continue; // infinite or no number
        assert_int_equal(half_from_float(f), h);
        if ((h & 0x7fff) == 0x7bff) continue; // the largest
        float middle = 0.5f * (f + next);     // exact; goes to the even one
        assert_int_equal(half_from_float(middle), h + (h & 1));
        assert_int_equal(half_from_float(nextafterf(middle, f)), h);
        assert_int_equal(half_from_float(nextafterf(middle, next)), h + 1);
    }
    assert_int_equal(half_from_float(1e9f), 0x7bff);
    assert_int_equal(half_from_float(-INFINITY), 0xfbff);
}

static void test_jpeg(void **state)
{
    (void)state;
    Image a, b;
    assert_int_equal(fs_image_new(&a, 50, 30, 3, NULL), 0);
    for (int i = 0; i < 50 * 30; i++)
        for (int c = 0; c < 3; c++) a.px[3 * i + c] = (float)(i % 50) / 60.0f + (float)c * 0.05f;
    assert_int_equal(fs_jpeg_write(temp("a.jpg"), &a, 97, NULL, NULL), 0);
    assert_int_equal(fs_jpeg_read(temp("a.jpg"), &b, NULL), 0);
    assert_close(&a, &b, 0.03f);
    fs_image_free(&a);
    fs_image_free(&b);
}

static void test_errors(void **state)
{
    (void)state;
    Image image = noise(4, 4, 3, 0, 1);
    FsError err = {0};
    assert_int_equal(fs_tiff_write_float("no/such/folder/a.tif", &image, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, "no/such/folder/a.tif"));
    assert_int_equal(fs_png_write("no/such/folder/a.png", &image, 8, &err), FS_ERR_IO);
    assert_int_equal(fs_jpeg_write("no/such/folder/a.jpg", &image, 90, NULL, &err), FS_ERR_IO);
    fs_image_free(&image);
    assert_int_equal(fs_file_write(temp("text"), "hello, I am no picture", 22, NULL), 0);
    int (*const readers[])(const char *, Image *, FsError *) = {fs_tiff_read, fs_png_read, fs_jpeg_read};
    for (int i = 0; i < 3; i++) {
        err = (FsError){0};
        assert_int_equal(readers[i](temp("text"), &image, &err), FS_ERR_INPUT);
        assert_non_null(strstr(err.message, temp("text")));
        assert_null(strchr(err.message, '\n'));
        assert_int_equal(readers[i](temp("missing"), &image, &err), FS_ERR_INPUT);
        assert_non_null(strstr(err.message, "No such file"));
    }
}

static int make_folder(void **state)
{
    if (temp_dir_make(state) < 0) return -1;
    folder = *state;
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_limits), cmocka_unit_test(test_resize), cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_orient), cmocka_unit_test(test_tone),   cmocka_unit_test(test_png),
        cmocka_unit_test(test_tiff),   cmocka_unit_test(test_half),   cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_errors),
    };
    return cmocka_run_group_tests(tests, make_folder, temp_dir_remove);
}

// The difference of a pair: exact on float TIFFs, levelled by EXIF exposure on JPEGs, and its errors.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/rng.h"
#include "image/image.h"
#include "image/tags.h"
#include "pair/pair.h"
#include "said.h"
#include "temp_dir.h"

static int pair(const char *flash, const char *noflash, const char *out, bool linear, const char *long_edge,
                FsError *err)
{
    FsSettings *set = fs_settings_new();
    said_forget();
    Log log = {.log = said_keep};
    set->linear = linear;
    if (long_edge) assert_int_equal(fs_settings_set(set, "long-edge", long_edge, NULL), 0);
    int rc = fs_pair_run(flash, noflash, out, set, &log, err);
    fs_settings_free(set);
    return rc;
}

static char *in(void **state, const char *name)
{
    return fs_file_path("%s/%s", (char *)*state, name);
}

static void make(Image *image, int width, int height, uint64_t seed, float low, float high)
{
    Rng rng = fs_rng_new(seed);
    assert_int_equal(fs_image_new(image, width, height, 3, NULL), 0);
    for (int i = 0; i < width * height * 3; i++) image->px[i] = fs_rng_range(&rng, low, high);
}

static void test_difference(void **state)
{
    char *f = in(state, "f.tif"), *n = in(state, "n.tif"), *out = in(state, "d.png"), *tif = in(state, "d.tif");
    Image a, b, linear, shown;
    make(&a, 31, 17, 1, 0.1f, 0.9f);
    make(&b, 31, 17, 2, -0.01f, 0.3f);
    assert_int_equal(fs_tiff_write_float(f, &a, NULL) | fs_tiff_write_float(n, &b, NULL), 0);
    assert_int_equal(pair(f, n, out, false, NULL, NULL), 0);
    assert_false(fs_file_exists(tif));
    FsError err = {0};
    FILE *edited = fopen(out, "ab");
    assert_int_equal(fputc(0, edited), 0);
    assert_int_equal(fclose(edited), 0);
    assert_int_equal(pair(f, n, out, true, NULL, &err), FS_ERR_INPUT); // not as it was written
    assert_non_null(strstr(err.message, out));
    unlink(out);
    assert_int_equal(pair(f, n, out, true, NULL, NULL), 0);
    assert_non_null(strstr(said, "taken to be the same"));
    assert_int_equal(fs_tiff_read(tif, &linear, NULL) | fs_png_read(out, &shown, NULL), 0);
    for (int i = 0; i < 31 * 17 * 3; i++) {
        float d = a.px[i] - b.px[i];
        assert_true(linear.px[i] == d);
        double expected = round(pow(fmax(d, 0), 0.22) * 255);
        assert_true(fabs(shown.px[i] * 255 - expected) < 0.51);
    }
    // The light added is said: sums over all pixels.
    double sum_a = 0, sum_b = 0, gain;
    for (int i = 0; i < 31 * 17 * 3; i++) sum_a += a.px[i], sum_b += b.px[i];
    assert_int_equal(sscanf(said + (strstr(said, "added ") - said), "added %lf times", &gain), 1);
    assert_true(fabs(gain / (sum_a / sum_b - 1) - 1) < 5e-3);
    // At a smaller size: the mean of the difference stays.
    fs_image_free(&linear);
    unlink(out), unlink(tif);
    assert_int_equal(pair(f, n, out, true, "10", NULL), 0);
    assert_int_equal(fs_tiff_read(tif, &linear, NULL), 0);
    assert_int_equal(linear.width, 10);
    double small = 0;
    for (int i = 0; i < linear.width * linear.height * 3; i++) small += linear.px[i];
    assert_true(fabs(small / (linear.width * linear.height * 3) - (sum_a - sum_b) / (31 * 17 * 3)) < 1e-4);
    // The wrong way round: said so.
    unlink(out);
    assert_int_equal(pair(n, f, out, false, NULL, NULL), 0);
    assert_non_null(strstr(said, "hardly brighter"));
    fs_image_free(&a), fs_image_free(&b), fs_image_free(&linear), fs_image_free(&shown);
    free(f), free(n), free(out), free(tif);
}

// Writes and frees them: a JPEG that says so of itself.
static void write_with(const char *path, const Image *image, Tags *tags)
{
    unsigned char *exif;
    size_t size;
    assert_int_equal(fs_tags_build(tags, 8, &exif, &size, NULL), 0);
    assert_int_equal(fs_jpeg_write(path, image, 100, &(JpegExtras){.exif = exif, .exif_size = size}, NULL), 0);
    free(exif);
    fs_tags_free(tags);
}

static void write_exposed(const char *path, const Image *image, uint32_t shutter, uint32_t iso, uint32_t flash)
{
    Tags tags = {0};
    assert_int_equal(fs_tags_put_ratio(&tags, TAGS_EXIF, 0x829a, 1, shutter, NULL), 0);
    assert_int_equal(fs_tags_put_number(&tags, TAGS_EXIF, 0x8827, TAG_SHORT, iso, NULL), 0);
    assert_int_equal(fs_tags_put_number(&tags, TAGS_EXIF, 0x9209, TAG_SHORT, flash, NULL), 0);
    write_with(path, image, &tags);
}

static void write_turned(const char *path, const Image *image, uint32_t orientation)
{
    Tags tags = {0};
    assert_int_equal(fs_tags_put_number(&tags, TAGS_MAIN, 0x0112, TAG_SHORT, orientation, NULL), 0);
    write_with(path, image, &tags);
}

static float decode_srgb(float v)
{
    return v <= 0.04045f ? v / 12.92f : powf((v + 0.055f) / 1.055f, 2.4f);
}

static void test_exposure(void **state)
{
    char *f = in(state, "f.jpg"), *n = in(state, "n.jpg"), *out = in(state, "e.png"), *tif = in(state, "e.tif");
    Image a, b, linear;
    make(&a, 32, 32, 1, 0.8f, 0.8f);
    make(&b, 32, 32, 2, 0.4f, 0.4f);
    write_exposed(f, &a, 50, 400, 9);
    write_exposed(n, &b, 100, 200, 16);
    assert_int_equal(pair(f, n, out, true, NULL, NULL), 0);
    assert_non_null(strstr(said, "multiplied by 4"));
    assert_non_null(strstr(said, "not RAW"));
    assert_null(strstr(said, "EXIF says"));
    assert_int_equal(fs_tiff_read(tif, &linear, NULL), 0);
    float expected = decode_srgb(0.8f) - 4 * decode_srgb(0.4f);
    assert_true(fabsf(linear.px[500] - expected) < 5e-3f);
    unlink(out), unlink(tif);
    assert_int_equal(pair(n, f, out, true, NULL, NULL), 0); // swapped
    assert_non_null(strstr(said, "EXIF says that the flash did not fire"));
    assert_non_null(strstr(said, "EXIF says that the flash fired"));
    fs_image_free(&a), fs_image_free(&b), fs_image_free(&linear);
    free(f), free(n), free(out), free(tif);
}

// The camera's sensor takes one of two alike photos for upside down.
static void test_turned(void **state)
{
    char *f = in(state, "tf.jpg"), *n = in(state, "tn.jpg"), *out = in(state, "t.png"), *tif = in(state, "t.tif");
    Image a, b, linear, turned;
    make(&a, 32, 16, 1, 0.8f, 0.8f);
    make(&b, 32, 16, 2, 0.4f, 0.4f);
    for (int i = 0; i < 8 * 32 * 3; i++) a.px[i] = 0.6f, b.px[i] = 0.2f; // the upper half is dark
    write_turned(f, &a, 1);
    write_turned(n, &b, 1);
    assert_int_equal(pair(f, n, out, true, NULL, NULL), 0);
    assert_null(strstr(said, "turned"));
    assert_int_equal(fs_tiff_read(tif, &linear, NULL), 0);
    for (int k = 0; k < 2; k++) { // half a turn, then a quarter
        write_turned(n, &b, k ? 6 : 3);
        unlink(out), unlink(tif);
        assert_int_equal(pair(f, n, out, true, NULL, NULL), 0);
        assert_non_null(strstr(said, "both are turned as that one"));
        assert_int_equal(fs_tiff_read(tif, &turned, NULL), 0);
        assert_memory_equal(turned.px, linear.px, fs_image_values(&linear) * sizeof(float));
        fs_image_free(&turned);
    }
    fs_image_free(&a), fs_image_free(&b), fs_image_free(&linear);
    free(f), free(n), free(out), free(tif);
}

static bool stop(void *user)
{
    (void)user;
    return true;
}

static void test_errors(void **state)
{
    char *a = in(state, "a.tif"), *b = in(state, "b.tif"), *out = in(state, "x.png"), *bad = in(state, "bad.dng");
    Image image;
    FsError err;
    make(&image, 40, 20, 1, 0, 1);
    assert_int_equal(fs_tiff_write_float(a, &image, NULL), 0);
    fs_image_free(&image);
    make(&image, 20, 10, 1, 0, 1); // the same proportions, which a small --long-edge would hide
    assert_int_equal(fs_tiff_write_float(b, &image, NULL), 0);
    fs_image_free(&image);
    assert_int_equal(pair(a, b, out, false, "10", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "20 x 10 pixels"));
    FsSettings *set = fs_settings_new();
    assert_int_equal(fs_pair_run(a, a, out, set, &(Log){.cancelled = stop}, &err), FS_ERR_CANCELLED);
    assert_false(fs_file_exists(out));
    fs_settings_free(set);
    assert_int_equal(pair(a, "/nonexistent.png", out, false, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "/nonexistent.png"));
    assert_int_equal(pair(a, a, a, false, NULL, &err), FS_ERR_USAGE);
    assert_int_equal(fs_file_write(bad, "II*\0", 4, NULL), 0);
    assert_int_equal(pair(bad, a, out, false, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, bad));
    assert_int_equal(pair(a, a, "/nonexistent/x.png", false, NULL, &err), FS_ERR_IO);
    free(a), free(b), free(out), free(bad);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_difference),
        cmocka_unit_test(test_exposure),
        cmocka_unit_test(test_turned),
        cmocka_unit_test(test_errors),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}

// The readers against files that other programs wrote, and against what is left of a file that was cut or damaged.
#include "photos.h"

#include <tiffio.h>
#include <unistd.h>

#include "base/rng.h"
#include "image/exif.h"
#include "image/photo.h"

typedef int Reader(const char *, Image *, FsError *);

static int pattern(int x, int y, int c)
{
    return (7 * x + 13 * y + 29 * c) % 256;
}

static void check(const char *file, Reader *reader, int channels, float scale, float offset, float tolerance)
{
    Image image;
    FsError err = {0};
    if (reader(given(file), &image, &err) != 0) fail_msg("%s", err.message);
    assert_int_equal(image.width, 24);
    assert_int_equal(image.height, 16);
    assert_int_equal(image.channels, channels);
    bool smooth = strstr(file, ".jpg") != NULL;
    for (int y = 0; y < 16; y++)
        for (int x = 0; x < 24; x++)
            for (int c = 0; c < channels; c++) {
                float want = scale * (float)(smooth ? 40 + 5 * x + 3 * y + 20 * c : pattern(x, y, c)) + offset;
                float got = image.px[(y * 24 + x) * channels + c];
                if (!(want - tolerance <= got && got <= want + tolerance))
                    fail_msg("%s: (%d, %d, %d) is %g, expected %g", file, x, y, c, got, want);
            }
    fs_image_free(&image);
}

static void test_written_by_opencv(void **state)
{
    (void)state;
    check("rgb8.png", fs_png_read, 3, 1 / 255.0f, 0, 1e-6f);
    check("rgb16.png", fs_png_read, 3, 1 / 255.0f, 0, 1e-6f);
    check("grey8.png", fs_png_read, 1, 1 / 255.0f, 0, 1e-6f);
    check("rgba8.png", fs_png_read, 3, 1 / 255.0f, 0, 1e-6f);
    check("rgb8.tif", fs_tiff_read, 3, 1 / 255.0f, 0, 1e-6f);
    check("rgb16.tif", fs_tiff_read, 3, 1 / 255.0f, 0, 1e-6f);
    check("grey16.tif", fs_tiff_read, 1, 1 / 255.0f, 0, 1e-6f);
    check("rgb32f.tif", fs_tiff_read, 3, 0.01f, -0.5f, 1e-6f);
    check("rgb.jpg", fs_jpeg_read, 3, 1 / 255.0f, 0, 0.03f);
    check("progressive.jpg", fs_jpeg_read, 3, 1 / 255.0f, 0, 0.03f);
    check("grey.jpg", fs_jpeg_read, 1, 1 / 255.0f, 0, 0.012f);
}

static PhotoLight light_of(const char *path)
{
    const SensorLevels wb = {.gain = {1, 1, 1}};
    PhotoSizes sizes = {.n = 1};
    PhotoLight light = PHOTO_LIGHT;
    FsError err = {0};
    if (fs_photo_read(path, &wb, &sizes, &light, &err) != 0) fail_msg("%s", err.message);
    fs_sizes_free(&sizes);
    return light;
}

static void test_light(void **state)
{
    (void)state;
    assert_int_equal(light_of(given("rgb8.png")), PHOTO_ENCODED);
    assert_int_equal(light_of(given("rgb8.tif")), PHOTO_ENCODED);
    assert_int_equal(light_of(given("rgb.jpg")), PHOTO_ENCODED);
    assert_int_equal(light_of(given("rgb16.png")), PHOTO_UNTOLD);
    assert_int_equal(light_of(given("rgb16.tif")), PHOTO_UNTOLD);
    assert_int_equal(light_of(given("rgb32f.tif")), PHOTO_LIGHT);
    assert_int_equal(light_of(given("ambient.dng")), PHOTO_LIGHT);
}

static void test_range(void **state)
{
    (void)state;
    const SensorLevels wb = {.gain = {1, 1, 1}};
    PhotoSizes sizes = {.n = 1};
    PhotoLight light;
    Image image;
    FsError err = {0};
    assert_int_equal(fs_image_new(&image, 4, 4, 3, NULL), 0);
    for (int i = 0; i < 48; i++) image.px[i] = i == 7 ? 300 : 0.4f; // a lamp
    assert_int_equal(fs_tiff_write_float(temp("range.tif"), &image, NULL), 0);
    assert_int_equal(light_of(temp("range.tif")), PHOTO_LIGHT);
    for (int i = 0; i < 48; i++) image.px[i] = (float)(i * 1000);
    assert_int_equal(fs_tiff_write_float(temp("range.tif"), &image, NULL), 0);
    assert_int_equal(fs_photo_read(temp("range.tif"), &wb, &sizes, &light, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "range.tif: its values reach 47000, expected light from 0 (black) to 1"));
    fs_image_free(&image);
}

// Layouts of TIFF that OpenCV does not write: tiles, separate planes, halves, alpha, white-is-zero.
static void test_tiff_layouts(void **state)
{
    (void)state;
    for (int layout = 0; layout < 4; layout++) {
        bool tiled = layout & 1, planes = layout & 2;
        int channels = 4, bits = 16;
        TIFF *tiff = TIFFOpen(temp("layout.tif"), "w");
        assert_non_null(tiff);
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 24), TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 18);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels), TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
        TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
        uint16_t extra = EXTRASAMPLE_UNASSALPHA;
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
        TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, planes ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
        if (tiled)
            TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16), TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
        else
            TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 5);
        int width = tiled ? 16 : 24, rows = tiled ? 16 : 5, step = planes ? 1 : channels;
        for (int p = 0; p < (planes ? channels : 1); p++)
            for (int y = 0; y < 18; y += rows)
                for (int x = 0; x < 24; x += width) {
                    uint16_t block[24 * 16 * 4] = {0};
                    for (int j = 0; j < rows; j++)
                        for (int i = 0; i < width; i++)
                            for (int c = 0; c < step; c++) // halves: (1 + k/1024) * 2^0, k the pattern
                                block[(j * width + i) * step + c] =
                                    (uint16_t)(0x3c00 + pattern(x + i, y + j, planes ? p : c));
                    if (tiled)
                        TIFFWriteTile(tiff, block, (uint32_t)x, (uint32_t)y, 0, (uint16_t)p);
                    else
                        TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, (uint32_t)y, (uint16_t)p), block,
                                              (tmsize_t)((rows < 18 - y ? rows : 18 - y) * width * step * 2));
                }
        TIFFClose(tiff);
        Image image;
        FsError err = {0};
        if (fs_tiff_read(temp("layout.tif"), &image, &err) != 0) fail_msg("%s", err.message);
        assert_int_equal(image.channels, 3);
        assert_int_equal(image.height, 18);
        for (int i = 0; i < 24 * 18 * 3; i++)
            assert_true(image.px[i] == 1 + (float)pattern(i / 3 % 24, i / 72, i % 3) / 1024);
        fs_image_free(&image);
    }
}

static int read_raw(const char *path, Image *image, FsError *err)
{
    const double wb[3] = {2, 1, 1.6};
    Image picture[2];
    int rc = read_whole(path, wb, false, picture, err);
    *image = picture[0];
    fs_image_free(&picture[1]);
    return rc;
}

static int read_plain_raw(const char *path, Image *image, FsError *err)
{
    const double wb[3] = {2, 1, 1.6};
    Image picture[2];
    int rc = read_whole(path, wb, true, picture, err);
    *image = picture[0];
    fs_image_free(&picture[1]);
    return rc;
}

static int read_exif(const char *path, Image *image, FsError *err)
{
    *image = (Image){0};
    ExifInfo info;
    return fs_exif_read(path, &info, err);
}

// Whatever is cut off or overwritten: a picture or an error that names the file, in one line.
static void abuse(const char *file, Reader *reader, int step)
{
    char *data;
    size_t size;
    Rng rng = fs_rng_new(5);
    assert_int_equal(fs_file_read(given(file), 1 << 20, &data, &size, NULL), 0);
    for (size_t n = 0; n < 2 * size; n += (size_t)(n % size < 300 ? 1 + step / 16 : step)) {
        size_t kept = n < size ? n : size;
        char *copy = malloc(size);
        memcpy(copy, data, size);
        if (n >= size) // second round: a few wrong bytes
            for (int k = 0; k < 4; k++)
                copy[k == 0 ? n - size : (size_t)fs_rng_below(&rng, (int)size)] = (char)fs_rng_u32(&rng);
        unlink(temp("abused")); // a new file each time: fs_file_write, and writing over one, would wait for the disk
        FILE *f = fopen(temp("abused"), "wb");
        assert_non_null(f);
        assert_int_equal(fwrite(copy, 1, kept, f), kept);
        assert_int_equal(fclose(f), 0);
        free(copy);
        Image image;
        FsError err = {0};
        if (reader(temp("abused"), &image, &err) != 0) {
            assert_null(image.px);
            assert_null(strchr(err.message, '\n'));
            if (err.code == FS_ERR_INPUT) assert_non_null(strstr(err.message, temp("abused")));
        } else if (n < size / 2 && reader != read_exif) {
            fail_msg("%s: a picture out of %zu of %zu bytes", file, n, size);
        }
        fs_image_free(&image);
    }
    free(data);
}

static void test_damaged(void **state)
{
    (void)state;
    abuse("rgb16.png", fs_png_read, 1);
    abuse("rgb8.png", fs_png_read, 7);
    abuse("rgb16.tif", fs_tiff_read, 1);
    abuse("rgb32f.tif", fs_tiff_read, 13);
    abuse("rgb.jpg", fs_jpeg_read, 11);
    abuse("progressive.jpg", fs_jpeg_read, 11);
    abuse("grey.jpg", fs_jpeg_read, 1);
    abuse("ambient.dng", read_raw, 41);
    abuse("linear.dng", read_plain_raw, 211);
    abuse("rgb.jpg", read_exif, 3);
    abuse("rgb8.tif", read_exif, 3);
    abuse("rgb8.png", read_exif, 3);
    abuse("turned.dng", read_exif, 7);
}

// A file is read as what it is, and what the caller left in the results is not taken for a picture.
static void test_kind_inside(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"rgb.jpg", "a.tif"},
                                           {"rgb8.png", "a.jpg"},
                                           {"rgb8.tif", "a.png"},
                                           {"rgb.jpg", "a.dng"},
                                           {"ambient.dng", "a.NEF"}};
    const SensorLevels wb = {.gain = {1, 1, 1}};
    PhotoLight light;
    for (int i = 0; i < 5; i++) {
        PhotoSizes sizes = {.n = 1};
        FsError err = {0};
        copy_photo(pairs[i][0], pairs[i][1]);
        memset(&sizes.size[0].rgb, 0xff, sizeof(Image));
        if (fs_photo_read(temp(pairs[i][1]), &wb, &sizes, &light, &err) != 0) fail_msg("%s", err.message);
        assert_int_equal(sizes.size[0].rgb.width, i == 4 ? 64 : 24);
        assert_int_equal(light, i < 4 ? PHOTO_ENCODED : PHOTO_LIGHT);
        fs_sizes_free(&sizes);
    }
    PhotoSizes sizes = {.n = 1};
    memset(&sizes.size[0].rgb, 0xff, sizeof(Image));
    assert_int_equal(fs_photo_read(temp("missing.jpg"), &wb, &sizes, &light, NULL), FS_ERR_INPUT);
    fs_sizes_free(&sizes);
    memset(&sizes.size[0].rgb, 0xff, sizeof(Image));
    assert_int_equal(fs_photo_read(temp("missing.dng"), &wb, &sizes, &light, NULL), FS_ERR_INPUT);
    fs_sizes_free(&sizes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_written_by_opencv), cmocka_unit_test(test_light),       cmocka_unit_test(test_range),
        cmocka_unit_test(test_tiff_layouts),      cmocka_unit_test(test_kind_inside), cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

// Colour profiles: curves and primaries of what programs and cameras embed, in every format, and damaged ones.
#include "photos.h"

#include <jpeglib.h>
#include <lcms2.h>
#include <math.h>
#include <png.h>
#include <tiffio.h>

#include "base/rng.h"
#include "image/photo.h"
#include "image/profile.h"

enum Made { P3, ADOBE, SRGB, LINEAR, WIDE_LINEAR, GREY, LAB, MADE };

// As memory; the caller frees.
static void *make_profile(enum Made made, cmsUInt32Number *size)
{
    static const cmsCIExyYTRIPLE srgb = {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}},
                                 p3 = {{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}},
                                 adobe = {{0.64, 0.33, 1}, {0.21, 0.71, 1}, {0.15, 0.06, 1}};
    static const double srgb_curve[] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    cmsCIExyY d65 = {0.3127, 0.3290, 1};
    cmsToneCurve *curve = made == P3 || made == SRGB ? cmsBuildParametricToneCurve(NULL, 4, srgb_curve)
                          : made == ADOBE            ? cmsBuildGamma(NULL, 2.19921875)
                                                     : cmsBuildGamma(NULL, made == GREY ? 1.8 : 1.0);
    cmsToneCurve *curves[3] = {curve, curve, curve};
    const cmsCIExyYTRIPLE *primaries = made == P3 || made == WIDE_LINEAR ? &p3 : made == ADOBE ? &adobe : &srgb;
    cmsHPROFILE h = made == GREY  ? cmsCreateGrayProfile(&d65, curve)
                    : made == LAB ? cmsCreateLab4Profile(NULL)
                                  : cmsCreateRGBProfile(&d65, primaries, curves);
    cmsFreeToneCurve(curve);
    assert_true(cmsSaveProfileToMem(h, NULL, size));
    void *data = malloc(*size);
    assert_true(cmsSaveProfileToMem(h, data, size));
    cmsCloseProfile(h);
    return data;
}

// lcms's own conversion to linear sRGB.
static void expect_like_lcms(const void *icc, cmsUInt32Number size, const Profile *profile, double tolerance)
{
    cmsCIExyY d65 = {0.3127, 0.3290, 1};
    cmsCIExyYTRIPLE primaries = {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}};
    cmsToneCurve *one = cmsBuildGamma(NULL, 1), *curves[3] = {one, one, one};
    cmsHPROFILE to = cmsCreateRGBProfile(&d65, &primaries, curves), from = cmsOpenProfileFromMem(icc, size);
    cmsHTRANSFORM transform =
        cmsCreateTransform(from, TYPE_RGB_FLT, to, TYPE_RGB_FLT, INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
    Rng rng = fs_rng_new(1);
    for (int i = 0; i < 300; i++) {
        float in[3], want[3], got[3];
        for (int c = 0; c < 3; c++) in[c] = got[c] = (float)fs_rng_below(&rng, 256) / 255.0f;
        cmsDoTransform(transform, in, want, 1);
        fs_profile_linearise(profile, got, 1);
        for (int c = 0; c < 3; c++)
            if (fabsf(want[c] - got[c]) > tolerance)
                fail_msg("%g %g %g: %g, not %g", in[0], in[1], in[2], got[c], want[c]);
    }
    cmsDeleteTransform(transform);
    cmsCloseProfile(from);
    cmsCloseProfile(to);
    cmsFreeToneCurve(one);
}

static void test_values(void **state)
{
    (void)state;
    for (enum Made made = 0; made < MADE; made++) {
        cmsUInt32Number size;
        void *icc = make_profile(made, &size);
        Profile profile;
        assert_int_equal(fs_profile_read(&profile, icc, size), made != LAB);
        assert_int_equal(profile.linear, made == LINEAR || made == WIDE_LINEAR);
        assert_int_equal(profile.srgb_curve, made == P3 || made == SRGB || made == LAB);
        assert_int_equal(profile.srgb_colors, made == SRGB || made == LINEAR || made == GREY || made == LAB);
        if (made < GREY) expect_like_lcms(icc, size, &profile, 0.004);
        float grey[6] = {0.5f, 0.5f, 0.5f, 1, 1, 1};
        fs_profile_linearise(&profile, grey, 2);
        for (int c = 0; c < 3; c++) assert_true(fabsf(grey[c] - grey[0]) < 1e-6f && fabsf(grey[3 + c] - 1) < 1e-5f);
        if (made == GREY) assert_true(fabs(grey[0] - pow(0.5, 1.8)) < 1e-3);
        free(icc);
    }
}

// Files of one colour, 0.8 0.4 0.2, with a profile.
static void write_jpeg(const char *path, const void *icc, unsigned size)
{
    struct jpeg_compress_struct out;
    struct jpeg_error_mgr manager;
    JSAMPLE px[8 * 3], *row = px;
    FILE *f = fopen(path, "wb");
    for (int i = 0; i < 24; i++) px[i] = i % 3 == 0 ? 204 : i % 3 == 1 ? 102 : 51;
    out.err = jpeg_std_error(&manager);
    jpeg_create_compress(&out);
    jpeg_stdio_dest(&out, f);
    out.image_width = out.image_height = 8, out.input_components = 3, out.in_color_space = JCS_RGB;
    jpeg_set_defaults(&out);
    jpeg_set_quality(&out, 100, TRUE);
    jpeg_start_compress(&out, TRUE);
    if (icc) jpeg_write_icc_profile(&out, icc, size);
    for (int y = 0; y < 8; y++) jpeg_write_scanlines(&out, &row, 1);
    jpeg_finish_compress(&out);
    jpeg_destroy_compress(&out);
    fclose(f);
}

// bits: 16, or 32 of floats.
static void write_tiff(const char *path, int bits, const void *icc, unsigned size)
{
    uint16_t px[24];
    float real[24];
    for (int i = 0; i < 24; i++) px[i] = i % 3 == 0 ? 52428 : i % 3 == 1 ? 26214 : 13107;
    for (int i = 0; i < 24; i++) real[i] = px[i] / 65535.0f;
    TIFF *tiff = TIFFOpen(path, "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 8), TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3), TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    if (bits == 32) TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    if (icc) TIFFSetField(tiff, TIFFTAG_ICCPROFILE, size, icc);
    TIFFWriteScanline(tiff, bits == 32 ? (void *)real : px, 0, 0);
    TIFFClose(tiff);
}

static void write_png(const char *path, const void *icc, unsigned size, double gamma)
{
    png_byte px[24];
    for (int i = 0; i < 24; i++) px[i] = i % 3 == 0 ? 204 : i % 3 == 1 ? 102 : 51;
    FILE *f = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, f);
    png_set_IHDR(png, info, 8, 1, 8, PNG_COLOR_TYPE_RGB, 0, 0, 0);
    if (icc) png_set_iCCP(png, info, "made", 0, icc, size);
    if (gamma > 0) png_set_gAMA(png, info, gamma);
    png_write_info(png, info);
    png_write_row(png, px);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    fclose(f);
}

// EXIF's ColorSpace: 1 is sRGB.
static void say_color_space(const char *path, int value)
{
    TIFF *tiff = TIFFOpen(path, "r+");
    uint64_t at;
    assert_non_null(tiff);
    TIFFFreeDirectory(tiff); // what it has read: TIFFCreateEXIFDirectory forgets it
    assert_int_equal(TIFFCreateEXIFDirectory(tiff), 0);
    assert_true(TIFFSetField(tiff, EXIFTAG_COLORSPACE, value) && TIFFWriteCustomDirectory(tiff, &at));
    assert_true(TIFFSetDirectory(tiff, 0) && TIFFSetField(tiff, TIFFTAG_EXIFIFD, at) && TIFFRewriteDirectory(tiff));
    TIFFClose(tiff);
}

static void expect_photo(const char *name, PhotoLight light, double r, double g, double b)
{
    const SensorLevels wb = {.gain = {1, 1, 1}};
    const double want[3] = {r, g, b};
    PhotoSizes sizes = {.n = 1};
    PhotoLight got;
    FsError err = {0};
    if (fs_photo_read(temp(name), &wb, &sizes, &got, &err) != 0) fail_msg("%s", err.message);
    assert_int_equal(got, light);
    for (int c = 0; c < 3; c++)
        if (fabs(sizes.size[0].rgb.px[c] - want[c]) > 0.006)
            fail_msg("%s: %d is %g, not %g", name, c, sizes.size[0].rgb.px[c], want[c]);
    fs_sizes_free(&sizes);
}

static void test_files(void **state)
{
    (void)state;
    cmsUInt32Number size;
    void *p3 = make_profile(P3, &size);
    // 0.6038 0.1329 0.0331 of Display P3, by its matrix to sRGB
    const double r = 1.2249 * 0.6038 - 0.2247 * 0.1329, g = -0.0420 * 0.6038 + 1.0419 * 0.1329;
    const double b = -0.0197 * 0.6038 - 0.0786 * 0.1329 + 1.0979 * 0.0331;
    write_jpeg(temp("p3.jpg"), p3, size);
    write_tiff(temp("p3.tif"), 16, p3, size);
    write_tiff(temp("p3_float.tif"), 32, p3, size);
    write_png(temp("p3.png"), p3, size, 0);
    expect_photo("p3.jpg", PHOTO_ENCODED, r, g, b);
    expect_photo("p3.tif", PHOTO_ENCODED, r, g, b);
    expect_photo("p3_float.tif", PHOTO_ENCODED, r, g, b);
    expect_photo("p3.png", PHOTO_ENCODED, r, g, b);
    memset((char *)p3 + 128, 0xff, 12); // no profile any more: as if there were none, but it is told
    write_jpeg(temp("p3.jpg"), p3, size);
    expect_photo("p3.jpg", PHOTO_UNREAD, 0.6038, 0.1329, 0.0331);
    free(p3);
    void *linear = make_profile(LINEAR, &size);
    for (int bits = 16; bits <= 32; bits += 16) {
        write_tiff(temp("linear.tif"), bits, linear, size);
        expect_photo("linear.tif", PHOTO_LIGHT, 0.8, 0.4, 0.2);
        write_tiff(temp("none.tif"), bits, NULL, 0);
        expect_photo("none.tif", bits == 32 ? PHOTO_LIGHT : PHOTO_UNTOLD, 0.8, 0.4, 0.2);
        say_color_space(temp("none.tif"), 65535); // uncalibrated
        expect_photo("none.tif", bits == 32 ? PHOTO_LIGHT : PHOTO_UNTOLD, 0.8, 0.4, 0.2);
        write_tiff(temp("exif.tif"), bits, NULL, 0);
        say_color_space(temp("exif.tif"), 1);
        if (bits == 32)
            expect_photo("exif.tif", PHOTO_LIGHT, 0.8, 0.4, 0.2);
        else
            expect_photo("exif.tif", PHOTO_ENCODED, 0.6038, 0.1329, 0.0331);
    }
    free(linear);
    write_png(temp("gamma.png"), NULL, 0, 1 / 1.8);
    expect_photo("gamma.png", PHOTO_ENCODED, pow(0.8, 1.8), pow(0.4, 1.8), pow(0.2, 1.8));
    write_png(temp("gamma.png"), NULL, 0, 1);
    expect_photo("gamma.png", PHOTO_LIGHT, 0.8, 0.4, 0.2);
    write_png(temp("gamma.png"), NULL, 0, 0.45455);
    expect_photo("gamma.png", PHOTO_ENCODED, 0.6038, 0.1329, 0.0331);
}

// Cameras set to Adobe RGB say so in EXIF's directory of interoperability, and embed no profile.
static void test_exif_says_adobe(void **state)
{
    (void)state;
    static const unsigned char exif[] = "II*\0\10\0\0\0\1\0\x69\x87\4\0\1\0\0\0\x1a\0\0\0\0\0\0\0"
                                        "\1\0\5\xa0\4\0\1\0\0\0\x2c\0\0\0\0\0\0\0"
                                        "\1\0\1\0\2\0\4\0\0\0R03\0\0\0\0\0";
    Image image;
    assert_int_equal(fs_image_new(&image, 8, 8, 3, NULL), 0);
    for (int i = 0; i < 192; i++) image.px[i] = i % 3 == 0 ? 0.8f : i % 3 == 1 ? 0.4f : 0.2f;
    const JpegExtras extras = {.exif = exif, .exif_size = sizeof exif - 1};
    assert_int_equal(fs_jpeg_write(temp("adobe.jpg"), &image, 100, &extras, NULL), 0);
    fs_image_free(&image);
    const double light[3] = {pow(0.8, 2.2), pow(0.4, 2.2), pow(0.2, 2.2)};
    expect_photo("adobe.jpg", PHOTO_ENCODED, 1.3984 * light[0] - 0.3984 * light[1], light[1],
                 -0.0429 * light[1] + 1.0429 * light[2]);
}

static void test_damaged(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(9);
    static Profile profile;
    for (enum Made made = 0; made < MADE; made++) {
        cmsUInt32Number size;
        unsigned char *icc = make_profile(made, &size);
        for (int i = 0; i < 400; i++) {
            size_t kept = i < 200 ? (size_t)fs_rng_below(&rng, (int)size) : size;
            unsigned char *copy = malloc(kept + 1);
            memcpy(copy, icc, kept);
            for (int k = 0; k < 6 && kept; k++) copy[fs_rng_below(&rng, (int)kept)] = (unsigned char)fs_rng_u32(&rng);
            float rgb[9] = {0, 0.5f, 1, -1, 2, NAN, 0.1f, 0.2f, 0.3f};
            fs_profile_read(&profile, copy, kept);
            fs_profile_linearise(&profile, rgb, 3);
            if (!profile.linear)
                for (int c = 0; c < 9; c++) assert_true(rgb[c] > -25 && rgb[c] < 25);
            free(copy);
        }
        free(icc);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_exif_says_adobe),
        cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

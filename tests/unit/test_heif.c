// HEIC and AVIF made here by libheif's encoders: values, depth, colours, orientation, EXIF, and what is left of a
// damaged one.
#include "ingest_run.h"

#include <libheif/heif.h>
#include <math.h>

#include "base/rng.h"
#include "image/exif.h"
#include "image/heif.h"
#include "image/photo.h"

enum { W = 64, H = 48 };
typedef struct Made {
    enum heif_compression_format format;
    int bits;
    bool flash, turned, icc;
    int primaries, transfer; // of a colour box; 0: none
    float gain;
} Made;

// Display values: smooth, so that no codec loses much.
static float value(int x, int y, int c)
{
    return 0.2f + (c == 0 ? 0.008f * (float)x : c == 1 ? 0.01f * (float)y : 0.004f * (float)(x + y));
}

static struct heif_error put_file(struct heif_context *context, const void *data, size_t size, void *user)
{
    (void)context;
    FILE *f = fopen(user, "wb");
    assert_true(f && fwrite(data, 1, size, f) == size && fclose(f) == 0);
    return (struct heif_error){heif_error_Ok, heif_suberror_Unspecified, "ok"};
}

static struct heif_image *make_image(const Made *made)
{
    struct heif_image *image;
    int stride, bytes = made->bits > 8 ? 2 : 1;
    enum heif_chroma chroma = bytes == 2 ? heif_chroma_interleaved_RRGGBB_LE : heif_chroma_interleaved_RGB;
    assert_int_equal(heif_image_create(W, H, heif_colorspace_RGB, chroma, &image).code, 0);
    assert_int_equal(heif_image_add_plane(image, heif_channel_interleaved, W, H, made->bits).code, 0);
    uint8_t *px = heif_image_get_plane(image, heif_channel_interleaved, &stride);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++) {
                float v = fminf(value(x, y, c) * (made->gain > 0 ? made->gain : 1), 1);
                int i = (int)lroundf(v * (float)((1 << made->bits) - 1)), at = y * stride + (3 * x + c) * bytes;
                px[at] = (uint8_t)i;
                if (bytes == 2) px[at + 1] = (uint8_t)(i >> 8);
            }
    return image;
}

static void make_heif(const char *name, const Made *made)
{
    // Orientation 6, which counts for nothing beside the file's own; ExposureTime 1/60, Flash.
    unsigned char exif[] = "II*\0\10\0\0\0\2\0\x12\1\3\0\1\0\0\0\6\0\0\0\x69\x87\4\0\1\0\0\0\x26\0\0\0\0\0\0\0"
                           "\2\0\x9a\x82\5\0\1\0\0\0\x44\0\0\0\x09\x92\3\0\1\0\0\0\x10\0\0\0\0\0\0\0\1\0\0\0\x3c\0\0\0";
    exif[60] = made->flash ? 9 : 16;
    struct heif_context *context = heif_context_alloc();
    struct heif_encoder *encoder;
    struct heif_image_handle *handle;
    struct heif_image *image = make_image(made);
    struct heif_encoding_options *options = heif_encoding_options_alloc();
    if (made->icc) assert_int_equal(heif_image_set_raw_color_profile(image, "prof", "nothing", 7).code, 0);
    if (made->transfer) {
        struct heif_color_profile_nclx *nclx = heif_nclx_color_profile_alloc();
        nclx->color_primaries = (enum heif_color_primaries)made->primaries;
        nclx->transfer_characteristics = (enum heif_transfer_characteristics)made->transfer;
        assert_int_equal(heif_image_set_nclx_color_profile(image, nclx).code, 0);
        options->output_nclx_profile = nclx;
        options->macOS_compatibility_workaround_no_nclx_profile = 0;
    }
    if (made->turned) options->image_orientation = heif_orientation_rotate_90_cw;
    assert_int_equal(heif_context_get_encoder_for_format(context, made->format, &encoder).code, 0);
    heif_encoder_set_lossy_quality(encoder, 95);
    heif_encoder_set_parameter_string(encoder, "chroma", made->format == heif_compression_AV1 ? "420" : "444");
    struct heif_error e = heif_context_encode_image(context, image, encoder, options, &handle);
    if (e.code) fail_msg("%s", e.message);
    assert_int_equal(heif_context_add_exif_metadata(context, handle, exif, sizeof exif - 1).code, 0);
    struct heif_writer writer = {.writer_api_version = 1, .write = put_file};
    assert_int_equal(heif_context_write(context, &writer, temp(name)).code, 0);
    if (options->output_nclx_profile) heif_nclx_color_profile_free(options->output_nclx_profile);
    heif_encoding_options_free(options);
    heif_image_handle_release(handle);
    heif_image_release(image);
    heif_encoder_release(encoder);
    heif_context_free(context);
}

static void test_values(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        Made made;
    } cases[] = {{"a.heic", {heif_compression_HEVC, 8}},
                 {"b.heic", {heif_compression_HEVC, 10, .flash = true}},
                 {"c.avif", {heif_compression_AV1, 8, .flash = true}},
                 {"d.AVIF", {heif_compression_AV1, 8}},
                 {"e.hif", {heif_compression_HEVC, 8, .turned = true}},
                 {"f.jpg", {heif_compression_HEVC, 8, .flash = true}}}; // under another's name
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const Made *made = &cases[i].made;
        Image image;
        ExifInfo exif;
        FsError err = {0};
        double worst = 0, wb[3];
        make_heif(cases[i].name, made);
        assert_int_equal(fs_photo_kind_inside(temp(cases[i].name)), PHOTO_HEIF);
        if (fs_photo_read_info(temp(cases[i].name), &exif, wb, NULL, &err) != 0) fail_msg("%s", err.message);
        assert_int_equal(fs_exif_flash_fired(&exif), made->flash);
        assert_int_equal(exif.orientation, 1);
        assert_true(fabs(exif.exposure_s - 1.0 / 60) < 1e-9);
        assert_true(made->turned ? exif.width == H && exif.height == W : exif.width == W && exif.height == H);
        if (fs_photo_read_stored(temp(cases[i].name), &image, &err) != 0) fail_msg("%s", err.message);
        assert_true(image.width == exif.width && image.height == exif.height && image.channels == 3);
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                for (int c = 0; c < 3; c++) {
                    const float *px = made->turned ? fs_image_at(&image, H - 1 - y, x) : fs_image_at(&image, x, y);
                    worst = fmax(worst, fabs((double)px[c] - (double)value(x, y, c)));
                }
        if (worst > 0.03) fail_msg("%s: %g", cases[i].name, worst);
        fs_image_free(&image);
    }
}

static void test_colors(void **state)
{
    (void)state;
    const SensorLevels wb = {.gain = {1, 1, 1}};
    static const struct {
        Made made;
        PhotoLight light;
        const char *words; // of the refusal
        float want[3];     // at the middle, of values 0.456 0.44 0.424
    } cases[] = {
        {{heif_compression_HEVC, 10, .primaries = 1, .transfer = 13}, PHOTO_ENCODED, NULL, {0.176f, 0.163f, 0.150f}},
        {{heif_compression_HEVC, 10, .primaries = 12, .transfer = 13}, PHOTO_ENCODED, NULL, {0.179f, 0.163f, 0.149f}},
        {{heif_compression_HEVC, 10, .primaries = 9, .transfer = 8}, PHOTO_LIGHT, NULL, {0.469f, 0.439f, 0.422f}},
        {{heif_compression_HEVC, 10, .primaries = 9, .transfer = 16}, PHOTO_LIGHT, "an HDR picture (PQ)"},
        {{heif_compression_HEVC, 10, .primaries = 9, .transfer = 18}, PHOTO_LIGHT, "an HDR picture (HLG)"},
        {{heif_compression_HEVC, 8, .icc = true}, PHOTO_UNREAD, NULL, {0.176f, 0.163f, 0.150f}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        PhotoSizes sizes = {.n = 1};
        PhotoLight light;
        FsError err = {0};
        make_heif("a.heif", &cases[i].made);
        int rc = fs_photo_read(temp("a.heif"), &wb, &sizes, &light, &err);
        assert_int_equal(rc, cases[i].words ? FS_ERR_INPUT : 0);
        if (cases[i].words) {
            if (!strstr(err.message, cases[i].words)) fail_msg("%s", err.message);
            continue;
        }
        assert_int_equal(light, cases[i].light);
        const float *px = fs_image_at(&sizes.size[0].rgb, 32, 24);
        for (int c = 0; c < 3; c++)
            if (fabsf(px[c] - cases[i].want[c]) > 0.008f) fail_msg("%zu: %d is %g", i, c, px[c]);
        fs_sizes_free(&sizes);
    }
}

static void test_ingest(void **state)
{
    (void)state;
    static const Made flash = {heif_compression_HEVC, 8, .flash = true, .gain = 1.3f},
                      none = {heif_compression_HEVC, 8};
    FILL({"rgb.jpg", "B.JPG"}, {"rgb.jpg", "C.JPG"});
    make_heif("photos/A.HEIC", &flash);
    make_heif("photos/B.HEIC", &none);
    make_heif("photos/C.HEIC", &none);
    copy_photo("ambient.dng", "photos/C.DNG");
    expect_good("photos", NULL, "3 photos: 1 with flash, 2 without");
    assert_non_null(strstr(said, "3 photos are there as RAW and as JPEG"));
    assert_non_null(strstr(said, "2 photos are not linear"));
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL);
    assert_string_equal(json_string_value(json_object_get(photo_entry(root, "B"), "file")), "B.HEIC");
    assert_string_equal(json_string_value(json_object_get(photo_entry(root, "C"), "file")), "C.DNG");
    json_decref(root);
}

static void test_damaged(void **state)
{
    (void)state;
    static const Made made = {heif_compression_HEVC, 8, .flash = true};
    char *data;
    size_t size;
    Rng rng = fs_rng_new(5);
    make_heif("whole.heic", &made);
    assert_int_equal(fs_file_read(temp("whole.heic"), 1 << 20, &data, &size, NULL), 0);
    for (size_t i = 0; i < 260; i++) {
        size_t kept = i < 100 ? size * i / 100 : size;
        char *copy = malloc(size);
        memcpy(copy, data, size);
        for (int k = 0; k < 4 && i >= 100; k++) // most of them where the boxes are
            copy[fs_rng_below(&rng, k ? (int)size : 500)] = (char)fs_rng_u32(&rng);
        FILE *f = fopen(temp("abused.heic"), "wb");
        assert_true(f && fwrite(copy, 1, kept, f) == kept && fclose(f) == 0);
        free(copy);
        Image image;
        LightTag tag;
        ExifInfo exif;
        FsError err = {0};
        assert_int_equal(fs_exif_read(temp("abused.heic"), &exif, NULL), 0);
        if (fs_heif_read_tag(temp("abused.heic"), &tag, NULL) == 0) fs_profile_tag_free(&tag);
        int rc = fs_heif_read(temp("abused.heic"), &image, &err);
        if (rc == 0) {
            assert_true(image.width > 0 && image.px && i >= 60);
            fs_image_free(&image);
        } else if (rc == FS_ERR_INPUT) {
            assert_non_null(strstr(err.message, temp("abused.heic")));
            assert_null(strchr(err.message, '\n'));
        }
    }
    free(data);
}

// Nothing is wrong with the file, but libheif has no decoder for it.
static void test_codec(void **state)
{
    (void)state;
    static const Made made = {.format = heif_compression_HEVC, .bits = 8};
    char *data, *at;
    size_t size;
    make_heif("codec.heic", &made);
    assert_int_equal(fs_file_read(temp("codec.heic"), 1 << 20, &data, &size, NULL), 0);
    while ((at = memmem(data, size, "hvc1", 4))) memcpy(at, "vvc1", 4);
    assert_int_equal(fs_file_write(temp("codec.heic"), data, size, NULL), 0);
    free(data);
    Image image;
    FsError err = {0};
    assert_int_equal(fs_heif_read(temp("codec.heic"), &image, &err), FS_ERR_INPUT);
    if (!strstr(err.message, "cannot read: convert it to JPEG")) fail_msg("%s", err.message);
}

const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:x265"; // the encoder's own, of these tests
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values),  cmocka_unit_test(test_colors), cmocka_unit_test(test_ingest),
        cmocka_unit_test(test_damaged), cmocka_unit_test(test_codec),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

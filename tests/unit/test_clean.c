// Photos without the mirrored room: the maths, and the files they are written to, read by libexif, libtiff and LibRaw.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <libexif/exif-data.h>

#include "base/rng.h"
#include "export/clean.h"
#include "export/clean_photo.h"
#include "image/exif.h"
#include "image/photo.h"
#include "image/raw.h"
#include "image/tiff_deep.h"
#include "image/tone.h"
#include "temp_dir.h"

enum { W = 96, H = 64, FACTOR = 4 };

static Image image(int width, int height, int channels)
{
    Image made;
    assert_int_equal(fs_image_new(&made, width, height, channels, NULL), 0);
    return made;
}

// Stripes: of the transmitted scene upright, of the mirrored one level; fine ones that only the photo shows.
static float transmitted(double x, double y, bool fine)
{
    return (float)(0.3 + 0.1 * sin(x * 0.5) * (x < W / 2) + (fine && x < W / 2 ? 0.05 * sin(x * 6 + y) : 0));
}

static float mirrored(double x, double y, bool fine)
{
    return (float)(0.2 + 0.1 * sin(y * 0.5) * (x >= W / 2) + (fine && x >= W / 2 ? 0.05 * sin(y * 6 + x) : 0));
}

typedef struct Case {
    Image photo, clipped, small, small_clipped, truth;
    CleanGuide guide;
} Case;

static Case make_case(float room)
{
    Case c = {.photo = image(W * FACTOR, H * FACTOR, 3),
              .clipped = image(W * FACTOR, H * FACTOR, 1),
              .small_clipped = image(W, H, 1),
              .truth = image(W * FACTOR, H * FACTOR, 3)};
    c.guide.T = image(W, H, 3), c.guide.whole = image(W, H, 3);
    for (int y = 0; y < c.photo.height; y++)
        for (int x = 0; x < 3 * c.photo.width; x++) {
            double u = (x / 3 + 0.5) / FACTOR, v = (y + 0.5) / FACTOR;
            size_t i = (size_t)y * (size_t)c.photo.width * 3 + (size_t)x;
            c.truth.px[i] = transmitted(u, v, true);
            c.photo.px[i] = c.truth.px[i] + room * mirrored(u, v, true);
        }
    for (int y = 0; y < H; y++)
        for (int x = 0; x < 3 * W; x++) {
            size_t i = (size_t)y * W * 3 + (size_t)x;
            c.guide.T.px[i] = transmitted(x / 3 + 0.5, y + 0.5, false);
            c.guide.whole.px[i] = c.guide.T.px[i] + room * mirrored(x / 3 + 0.5, y + 0.5, false);
        }
    assert_int_equal(fs_image_resize_area(&c.photo, W, H, &c.small, NULL), 0);
    return c;
}

static void clean(Case *c)
{
    assert_int_equal(fs_clean_photo_guide(&c->guide, &c->small, &c->small_clipped, NULL, NULL), 0);
    assert_int_equal(fs_clean_photo_apply(&c->guide, NULL, &c->photo, &c->clipped, NULL), 0);
}

static void free_case(Case *c)
{
    Image *const all[] = {&c->photo, &c->clipped, &c->small, &c->small_clipped, &c->truth};
    for (int i = 0; i < 5; i++) fs_image_free(all[i]);
    fs_clean_photo_free(&c->guide);
}

// Root mean square difference to the truth in columns first <= x < end of the working image, borders left out.
static double difference(const Case *c, int first, int end)
{
    double sum = 0;
    int n = 0;
    for (int y = 4 * FACTOR; y < (H - 4) * FACTOR; y++)
        for (int x = first * FACTOR; x < end * FACTOR; x++, n++) {
            size_t i = 3 * ((size_t)y * (size_t)c->photo.width + (size_t)x);
            sum += pow((double)c->photo.px[i] - (double)c->truth.px[i], 2);
        }
    return sqrt(sum / n);
}

static void test_without_room(void **state)
{
    (void)state;
    Case c = make_case(0);
    clean(&c);
    for (size_t i = 0; i < fs_image_values(&c.photo); i++)
        assert_true(fabsf(c.photo.px[i] - c.truth.px[i]) < 1e-3f * c.truth.px[i]); // but for the gate's last per mille
    free_case(&c);
}

static void test_detail_goes_where_it_belongs(void **state)
{
    (void)state;
    Case c = make_case(1);
    clean(&c);
    // Left, the fine stripes (0.05 / sqrt(2) = 0.035) are T's and stay, dimmed by its share; right, the room's go.
    assert_true(difference(&c, 8, W / 2 - 6) < 0.022);
    assert_true(difference(&c, W / 2 + 6, W - 8) < 0.012);
    free_case(&c);
}

// Of a lamp that clips, the renders know more.
static void test_clipped(void **state)
{
    (void)state;
    Case c = make_case(0);
    for (int y = 80; y < 120; y++)
        for (int x = 200; x < 260; x++) {
            size_t at = (size_t)y * (size_t)c.photo.width + (size_t)x;
            c.clipped.px[at] = 1;
            for (int k = 0; k < 3; k++) c.photo.px[3 * at + (size_t)k] = 0.05f;
        }
    c.guide.full = 0.05f;
    fs_image_free(&c.small);
    fs_image_free(&c.small_clipped);
    assert_int_equal(fs_image_resize_area(&c.photo, W, H, &c.small, NULL), 0);
    assert_int_equal(fs_image_resize_area(&c.clipped, W, H, &c.small_clipped, NULL), 0);
    clean(&c);
    assert_true(difference(&c, 52, 62) < 0.01);
    free_case(&c);
}

// What a mask covers is black in the working image, even where the photo is clipped: it is the same photo.
static void test_masked_and_clipped(void **state)
{
    char *out = *state;
    Image photo = image(8, 8, 3), mask = image(8, 8, 1);
    FilePath path = fs_file_at("%s/a.png", out);
    PhotoFile file = {.path = "a.png", .gain = 1};
    View view = {.name = "a", .camera = {.width = 8, .height = 8}, .distorted = true};
    struct FsProject project = {.out = out};
    const Originals originals = {.photos = {.folder = out, .photo = &file, .n = 1}, .of_view = (int[]){0}};
    const CleanArgs args = {.project = &project, .views = &(Dataset){&view, 1}, .originals = &originals};
    const SensorLevels levels = {.gain = {1, 1, 1}};
    PhotoSizes sizes = {.n = 1};
    PhotoLight light;
    for (int i = 0; i < 192; i++) photo.px[i] = i < 96 ? 1 : 0.5f; // the upper half is clipped
    for (int i = 32; i < 64; i++) mask.px[i] = 1;
    assert_int_equal(fs_png_write(path.text, &photo, 8, NULL), 0);
    assert_int_equal(fs_photo_read(path.text, &levels, &sizes, &light, NULL), 0);
    memset(sizes.size[0].rgb.px, 0, 48 * sizeof(float)); // half of which is masked
    assert_int_equal(fs_file_mkdirs(fs_file_at("%s/linear", out).text, NULL), 0);
    assert_int_equal(fs_tiff_write_float(fs_file_at("%s/linear/a.tif", out).text, &sizes.size[0].rgb, NULL), 0);
    assert_int_equal(fs_png_write(fs_file_at("%s/linear/a_mask.png", out).text, &mask, 8, NULL), 0);
    FsError err = {0};
    if (fs_clean_check(&args, &err) != 0) fail_msg("%s", err.message);
    for (int i = 96; i < 192; i++) photo.px[i] = 0.6f; // what is not masked counts
    file.path = "b.png";
    assert_int_equal(fs_png_write(fs_file_at("%s/b.png", out).text, &photo, 8, NULL), 0);
    assert_int_equal(fs_clean_check(&args, NULL), FS_ERR_INPUT);
    fs_sizes_free(&sizes);
    fs_image_free(&photo);
    fs_image_free(&mask);
}

// ---- tags and files ----

static Tags some_tags(void)
{
    Tags tags = {0};
    const double matrix[3] = {1.5, -0.25, 0};
    assert_int_equal(fs_tags_put_text(&tags, TAGS_MAIN, 0x010f, "Maker", NULL), 0);
    assert_int_equal(fs_tags_put_number(&tags, TAGS_EXIF, 0x9209, TAG_SHORT, 25, NULL), 0);
    assert_int_equal(fs_tags_put_number(&tags, TAGS_EXIF, 0x8827, TAG_SHORT, 100, NULL), 0);
    assert_int_equal(fs_tags_put_number(&tags, TAGS_EXIF, 0x8827, TAG_SHORT, 400, NULL), 0); // replaced
    assert_int_equal(fs_tags_put_text(&tags, TAGS_GPS, 0x001d, "2024:03:16", NULL), 0);
    assert_int_equal(fs_tags_put_fractions(&tags, 0xc621, TAG_SRATIONAL, matrix, 3, NULL), 0);
    return tags;
}

static void test_tags(void **state)
{
    (void)state;
    Tags tags = some_tags(), copy;
    unsigned char *block;
    size_t size;
    char text[64];
    assert_int_equal(tags.n, 5);
    assert_int_equal(fs_tags_build(&tags, 8, &block, &size, NULL), 0);
    unsigned char *segment = malloc(size + 6);
    memcpy(segment, "Exif\0", 6);
    memcpy(segment + 6, block, size);
    ExifData *exif = exif_data_new_from_data(segment, (unsigned)size + 6);
    assert_non_null(exif);
    exif_entry_get_value(exif_data_get_entry(exif, EXIF_TAG_MAKE), text, sizeof text);
    assert_string_equal(text, "Maker");
    exif_entry_get_value(exif_data_get_entry(exif, EXIF_TAG_ISO_SPEED_RATINGS), text, sizeof text);
    assert_string_equal(text, "400");
    ExifEntry *date = exif_content_get_entry(exif->ifd[EXIF_IFD_GPS], (ExifTag)0x001d);
    assert_non_null(date);
    assert_memory_equal(date->data, "2024:03:16", 11);
    exif_data_unref(exif);
    assert_int_equal(fs_tags_copy(&copy, &tags, NULL), 0);
    assert_int_equal(copy.n, tags.n);
    static const unsigned char much[70000];
    const Tag large = {.id = 1, .type = TAG_BYTE, .count = sizeof much}, odd = {.id = 1, .type = 99, .count = 1};
    assert_int_equal(fs_tags_put(&tags, &large, much, NULL), FS_ERR_USAGE);
    assert_int_equal(fs_tags_put(&tags, &odd, much, NULL), FS_ERR_USAGE);
    free(segment);
    free(block);
    fs_tags_free(&tags);
    fs_tags_free(&copy);
}

// Of a photo that says more of itself than a JPEG holds, what is long is left out, and the new file holds the rest.
static void test_long_tags(void **state)
{
    FilePath path = fs_file_at("%s/long.tif", (const char *)*state);
    static unsigned char much[45000];
    Image small = image(2, 2, 3);
    memset(much, 'x', sizeof much);
    for (int shape = 0; shape < 2; shape++) {
        Tags tags = some_tags(), back;
        unsigned char *block;
        size_t size;
        for (int i = 0; i < (shape ? 3 : 1); i++) {
            const Tag tag = {.folder = TAGS_EXIF,
                             .id = (uint16_t)(0x9286 + i), // comments and such
                             .type = TAG_UNDEFINED,
                             .count = shape ? 9000 : sizeof much};
            assert_int_equal(fs_tags_put(&tags, &tag, much, NULL), 0);
        }
        FsError why = {0};
        if (fs_tiff_deep_write(path.text, &small, &tags, NULL, 0, &why) < 0) fail_msg("%s", why.message);
        fs_tags_free(&tags);
        assert_int_equal(fs_exif_read_tags(path.text, &back, NULL), 0);
        assert_int_equal(back.n, 4 + (shape ? 2 : 0));
        for (int i = 0; i < 20; i++) // what the new file says of itself
            assert_int_equal(fs_tags_put_text(&back, TAGS_EXIF, (uint16_t)(0xa000 + i), (char[200]){"sixty"}, NULL), 0);
        assert_int_equal(fs_tags_build(&back, 8, &block, &size, NULL), 0);
        assert_true(size < 65000);
        const JpegExtras extras = {.exif = block, .exif_size = size};
        FsError err = {0};
        if (fs_jpeg_write(fs_file_at("%s/long.jpg", (const char *)*state).text, &small, 95, &extras, &err) < 0)
            fail_msg("%s", err.message);
        free(block);
        fs_tags_free(&back);
    }
    fs_image_free(&small);
}

static Image noisy(int width, int height)
{
    Image made = image(width, height, 3);
    Rng rng = fs_rng_new(5);
    for (size_t i = 0; i < fs_image_values(&made); i++) made.px[i] = 0.1f + 0.8f * (float)fs_rng_uniform(&rng);
    return made;
}

static void test_tiff(void **state)
{
    FilePath path = fs_file_at("%s/a.tif", (const char *)*state);
    Image a = noisy(301, 200), b;
    Tags tags = some_tags(), back;
    void *icc;
    size_t size;
    LightTag light;
    Profile profile;
    for (int s = PROFILE_SRGB; s <= PROFILE_P3; s++) {
        assert_int_equal(fs_profile_make((ProfileSpace)s, &icc, &size, NULL), 0);
        assert_int_equal(fs_tiff_deep_write(path.text, &a, &tags, icc, size, NULL), 0);
        assert_int_equal(fs_tiff_read(path.text, &b, NULL), 0); // by libtiff
        assert_true(b.width == a.width && b.height == a.height);
        for (size_t i = 0; i < fs_image_values(&a); i++) assert_true(fabsf(a.px[i] - b.px[i]) < 0.6f / 65535);
        assert_int_equal(fs_tiff_read_tag(path.text, &light, NULL), 0);
        assert_true(light.deep && light.icc_size == size && memcmp(light.icc, icc, size) == 0);
        assert_true(fs_profile_read(&profile, icc, size) && profile.srgb_curve);
        assert_int_equal(profile.srgb_colors, s == PROFILE_SRGB);
        // Into the space and back by its profile.
        float rgb[3] = {0.5f, 0.25f, 0.75f};
        fs_profile_to_space((ProfileSpace)s, rgb, 1);
        for (int c = 0; c < 3; c++) rgb[c] = fs_tone_srgb_encode(rgb[c]);
        fs_profile_linearise(&profile, rgb, 1);
        assert_true(fabsf(rgb[0] - 0.5f) < 2e-3f && fabsf(rgb[1] - 0.25f) < 2e-3f && fabsf(rgb[2] - 0.75f) < 2e-3f);
        fs_profile_tag_free(&light);
        fs_image_free(&b);
        free(icc);
    }
    assert_int_equal(fs_exif_read_tags(path.text, &back, NULL), 0);
    assert_int_equal(back.n, 4); // the matrix is none of EXIF's
    fs_tags_free(&back);
    fs_tags_free(&tags);
    fs_image_free(&a);
}

// LibRaw finds the light that was written, the white balance and the matrix.
static void test_dng(void **state)
{
    FilePath path = fs_file_at("%s/a.dng", (const char *)*state);
    Image a = noisy(120, 90);
    Tags tags = some_tags();
    const DngCamera camera = {.name = "Maker Camera 1",
                              .camera_from_xyz = {1.5, -0.7, -0.2, -0.9, 1.8, 0.05, 0.04, -0.14, 0.7},
                              .neutral = {0.5, 1, 0.625},
                              .baseline_exposure = 0.5};
    assert_int_equal(fs_tiff_deep_write_dng(path.text, &a, &tags, &camera, NULL), 0);
    RawInfo info;
    FsError err = {0};
    if (fs_raw_read_info(path.text, &info, &err) != 0) fail_msg("%s", err.message);
    assert_true(fabs(info.white_balance[0] - 2) < 1e-3 && fabs(info.white_balance[2] - 1.6) < 1e-3);
    assert_true(info.srgb_from_camera[0] != 0 && info.orientation == 1);
    for (int i = 0; i < 9; i++) assert_true(fabs(info.camera_from_xyz[i] - camera.camera_from_xyz[i]) < 1e-3);
    assert_true(fabs(info.baseline_exposure - 0.5) < 1e-3);
    PhotoSizes sizes = {.n = 1};
    if (fs_raw_read(path.text, info.white_balance, false, &sizes, &err) != 0) fail_msg("%s", err.message);
    const Image *b = &sizes.size[0].rgb;
    assert_true(b->width == a.width && b->height == a.height);
    for (size_t i = 0; i < fs_image_values(&a); i++) {
        float want = a.px[i] * (float)info.white_balance[i % 3];
        assert_true(fabsf(want - b->px[i]) < 2e-3f);
    }
    fs_sizes_free(&sizes);
    fs_tags_free(&tags);
    fs_image_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_room),
        cmocka_unit_test(test_detail_goes_where_it_belongs),
        cmocka_unit_test(test_clipped),
        cmocka_unit_test_setup_teardown(test_masked_and_clipped, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_tags),
        cmocka_unit_test_setup_teardown(test_long_tags, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_tiff, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_dng, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// The ingest stage: what it makes of a folder of photos, and what it says about folders it cannot use.
#include "ingest_run.h"

#include <math.h>
#include <sys/resource.h>
#include <unistd.h>

#include "image/image.h"
#include "ingest/develop.h"
#include "synth/photo_file.h"

static void test_good(void **state)
{
    (void)state;
    FILL(FOUR);
    expect_good("photos", SET("long-edge=32"), "2 with flash, 2 without");
    for (const char *warning = strstr(said, "W "); warning; warning = strstr(warning + 1, "W "))
        assert_memory_equal(warning, "W only 2 photos", 15);
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL), *entry = photo_entry(root, "A_3");
    assert_int_equal(json_array_size(json_object_get(root, "photos")), 4);
    assert_int_equal(figure(root, "long_edge"), 32);
    assert_true(fabs(json_number_value(json_array_get(json_object_get(root, "white_balance"), 2)) - 1.6) < 1e-5);
    assert_true(json_is_true(json_object_get(entry, "flash")));
    assert_true(json_is_false(json_object_get(photo_entry(root, "A_2"), "flash")));
    assert_string_equal(json_string_value(json_object_get(entry, "file")), "A_3.DNG");
    assert_string_equal(json_string_value(json_object_get(entry, "quality")), "raw");
    assert_true(figure(entry, "width") == 32 && figure(entry, "height") == 24);
    assert_true(figure(entry, "orig_width") == 64 && figure(entry, "orig_height") == 48);
    assert_true(figure(entry, "exposure_s") == 0.25 && figure(entry, "iso") == 200 && figure(entry, "f_number") == 5.6);
    assert_true(figure(entry, "focal_px") == 30); // 24 mm * 2.5 / mm, halved
    json_decref(root);

    Image photo, mask;
    assert_int_equal(fs_tiff_read(temp("out/linear/A_2.tif"), &photo, NULL), 0);
    assert_int_equal(fs_png_read(temp("out/linear/A_2_mask.png"), &mask, NULL), 0);
    assert_true(photo.width == 32 && photo.height == 24 && photo.channels == 3 && mask.channels == 1);
    for (int y = 2; y < 22; y++)
        for (int x = 2; x < 13; x++) // the mean over a 2 x 2 cell of what make.py put there
            for (int c = 0; c < 3; c++) {
                double at_x = 2 * x + 0.5, at_y = 2 * y + 0.5;
                double want = 0.2 + (c == 0 ? 0.004 * at_x : c == 1 ? 0.003 * at_y : 0.002 * (at_x + at_y));
                assert_true(fabs(photo.px[(y * 32 + x) * 3 + c] - want) < 0.003);
            }
    for (int y = 0; y < 24; y++)
        for (int x = 0; x < 32; x++) { // saturated: 40..43 x 20..23, and 2 pixels around by the demosaic
            bool far = x < 19 || x > 22 || y < 9 || y > 12, inside = x >= 20 && x < 22 && y >= 10 && y < 12;
            if (far) assert_true(mask.px[y * 32 + x] == 1);
            if (inside) assert_true(mask.px[y * 32 + x] == 0);
            const float *p = photo.px + (y * 32 + x) * 3; // and there what is darker than white counts
            if (!far && !inside)
                assert_true(fabsf(mask.px[y * 32 + x] - (fmaxf(p[0], fmaxf(p[1], p[2])) < 0.9f ? 0.5f : 0)) < 0.01f);
        }
    fs_image_free(&photo);
    fs_image_free(&mask);
}

static void test_again(void **state)
{
    (void)state;
    FILL(FOUR);
    expect_good("photos", NULL, "2 with flash");
    expect_good("photos", NULL, "skipped");
    expect_good("photos", SET("force=true"), "2 with flash");
    expect_good("photos", SET("long-edge=16"), "2 with flash");
    copy_photo("ambient.dng", "photos/A_5.DNG");
    expect_good("photos", SET("long-edge=16"), "3 without");
    unlink(temp("photos/A_1.DNG"));
    expect_good("photos", SET("long-edge=16"), "1 with flash");
    assert_false(fs_file_exists(temp("out/linear/A_1.tif")));
    fs_file_remove_tree(temp("photos"));
    expect_good("photos", SET("long-edge=16"), "skipped");
}

static void test_threads(void **state)
{
    (void)state;
    FILL(FOUR, {"gbrg.dng", "A_5.dng"});
    char *one, *four;
    size_t n, m;
    expect_good("photos", SET("threads=1"), NULL);
    assert_int_equal(fs_file_read(temp("out/linear/A_3.tif"), 1 << 20, &one, &n, NULL), 0);
    expect_good("photos", SET("threads=4", "force=true"), NULL);
    assert_int_equal(fs_file_read(temp("out/linear/A_3.tif"), 1 << 20, &four, &m, NULL), 0);
    assert_int_equal(n, m);
    assert_memory_equal(one, four, n);
    free(one);
    free(four);
}

static void test_missing(void **state)
{
    (void)state;
    fs_file_remove_tree(temp("photos"));
    fs_file_remove_tree(temp("out"));
    expect_error("photos", NULL, "No such file");
    assert_false(fs_file_exists(temp("out/done/ingest.json")));
    FILL({"make.py", "notes.txt"});
    expect_error("photos", NULL, "no photos (1 other files, e.g. notes.txt)");
    expect_error("photos/notes.txt", NULL, "is a file, expected the folder");
    FILL({"flash.dng", "A.dng"});
    expect_error("photos", NULL, "one photo");
    FILL({"flash.dng", "A.dng"}, {"flash.dng", "B.dng"});
    expect_error("photos", NULL, "only flash photos");
    FILL({"ambient.dng", "A.dng"}, {"gbrg.dng", "B.dng"});
    expect_error("photos", NULL, "no flash photos");
    FILL({"rgb16.tif", "A.tif"}, {"rgb16.tif", "B.tif"});
    expect_error("photos", NULL, "--flash-glob");
    FILL({"flash.dng", "A.dng"}, {"rgb16.png", "A.png"});
    expect_error("photos", NULL, "rename or remove");
    FILL({"flash.dng", "A.dng"}, {"flash.dng", "A.DNG"});
    expect_error("photos", NULL, "rename or remove");
}

// What COLMAP will not pose is said before it is asked; one lighting is enough for what uses one.
static void test_fewest(void **state)
{
    (void)state;
    static const char *const cases[][3] = {{"separation", "full", "4 photos with flash and 5 without: COLMAP needs"},
                                           {"lighting", "flash", "4 photos with flash"},
                                           {"lighting", "noflash", "program not found"},
                                           {"separation", "none", "program not found"}};
    FILL(FOUR, {"flash.dng", "A_5.DNG"}, {"flash.dng", "A_6.DNG"}, {"ambient.dng", "A_7.DNG"},
         {"ambient.dng", "A_8.DNG"}, {"ambient.dng", "A_9.DNG"});
    for (int i = 0; i < 4; i++) {
        FsSettings *set = fs_settings_new();
        FsProject *project;
        FsError err = {0};
        const char *colmap = strstr(cases[i][2], "not found") ? "/none/colmap" : "/bin/false";
        assert_int_equal(fs_settings_set(set, "colmap", colmap, NULL), 0);
        assert_int_equal(fs_settings_set(set, "steps", "10", NULL), 0);
        assert_int_equal(fs_settings_set(set, cases[i][0], cases[i][1], NULL), 0);
        assert_int_equal(fs_project_open(&project, temp("out"), set, NULL, NULL), 0);
        assert_int_equal(fs_run(project, temp("photos"), &err), FS_ERR_INPUT);
        if (!strstr(err.message, cases[i][2])) fail_msg("'%s' is not '%s'", err.message, cases[i][2]);
        fs_project_close(project);
        fs_settings_free(set);
    }
    FILL({"flash.dng", "A.dng"}, {"flash.dng", "B.dng"});
    expect_good("photos", SET("separation=none"), "2 with flash, 0 without");
    expect_good("photos", SET("lighting=flash"), "skipped");
    expect_error("photos", SET("lighting=noflash", "force=true"), "only flash photos");
}

static void test_flash_state(void **state)
{
    (void)state;
    FILL({"rgb16.tif", "on_1.tif"}, {"rgb16.tif", "off_1.tif"}, {"rgb16.png", "on_2.png"});
    expect_good("photos", SET("flash-glob=on_*"), "2 with flash, 1 without (--flash-glob)");
    expect_error("photos", SET("flash-glob=none*"), "no photo's name matches");
    expect_error("photos", SET("flash-glob=o*"), "only flash photos");
    char setting[200], *list = strdup(temp("list.txt"));
    snprintf(setting, sizeof setting, "flash-list=%s", list);
    static const struct {
        const char *text, *error; // NULL: on_1 and on_2
    } lists[] = {{"# with flash\r\n on_1 \r\non_2.png # and so on\n\n", NULL},
                 {"\xef\xbb\xbfon_1.tif\non_2.png\n", NULL}, // byte-order mark
                 {"ON_1.TIF\nOn_2", NULL},
                 {"C:\\Users\\me\\on_1.tif\r\n\"/home/me/photos/on_2.png\"\r\n", NULL},
                 {"on_1.NEF\non_2.jpeg\n", NULL}, // the other file of the shot
                 {"on_1\nlost.tif\n", "'lost.tif' is no photo"},
                 {"nobody\n", "'nobody' is no photo"},
                 {"on\n", "'on' is no photo"},
                 {"# on_1\n", "names no photo"},
                 {"\xff\xfeo\0n\0", "save it as UTF-8"}};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        size_t n = i + 1 < sizeof lists / sizeof *lists ? strlen(lists[i].text) : 6;
        assert_int_equal(fs_file_write(list, lists[i].text, n, NULL), 0);
        if (lists[i].error)
            expect_error("photos", SET(setting), lists[i].error);
        else
            expect_good("photos", SET(setting), "2 with flash, 1 without (--flash-list)");
        fs_file_remove_tree(temp("out"));
    }
    unlink(list);
    expect_error("photos", SET(setting), "list.txt");
    FILL({"rgb16.tif", "IMG#12.tif"}, {"rgb16.tif", "IMG_3.tif"});
    assert_int_equal(fs_file_write(list, "IMG#12.jpg\t# not IMG_3\n", 23, NULL), 0);
    expect_good("photos", SET(setting), "1 with flash, 1 without (--flash-list)");
    FILL({"rgb16.tif", "#12.tif"}, {"rgb16.tif", "#3.tif"});
    assert_int_equal(fs_file_write(list, "#12.jpg \n# 3\n", 13, NULL), 0);
    expect_good("photos", SET(setting), "1 with flash, 1 without (--flash-list)");
    free(list);
    // EXIF beside photos without: those are left out
    FILL(FOUR, {"grey.jpg", "B.jpg"});
    expect_good("photos", NULL, "W left out");
    assert_non_null(strstr(said, "B.jpg: its EXIF does not tell"));
}

static void test_unreadable(void **state)
{
    (void)state;
    char *data;
    size_t size;
    FILL(FOUR);
    assert_int_equal(fs_file_read(given("flash.dng"), 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(fs_file_write(temp("photos/A_3.DNG"), data, size / 2 + 2000, NULL), 0);
    expect_good("photos", NULL, "W left out");
    assert_non_null(strstr(said, "A_3.DNG"));
    assert_false(fs_file_exists(temp("out/linear/A_3.tif")));
    assert_int_equal(fs_file_write(temp("photos/A_2.DNG"), "nothing", 7, NULL), 0);
    copy_photo("ambient.dng", "photos/A_5.DNG");
    copy_photo("ambient.dng", "photos/A_6.DNG");
    expect_good("photos", NULL, "A_2.DNG"); // a third is lost
    assert_int_equal(fs_file_write(temp("photos/A_1.DNG"), data, size / 2 + 2000, NULL), 0);
    expect_error("photos", NULL, "A_1.DNG, A_2.DNG, A_3.DNG");
    free(data);
}

// A RAW file that is cut is no reason to develop one shot in another way.
static void test_cut_raw_beside_jpeg(void **state)
{
    (void)state;
    char *data;
    size_t size;
    FILL(FOUR, {"rgb.jpg", "A_3.JPG"}, {"rgb.jpg", "A_1.JPG"});
    assert_int_equal(fs_file_read(given("flash.dng"), 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(fs_file_write(temp("photos/A_3.DNG"), data, size / 2 + 2000, NULL), 0);
    free(data);
    expect_good("photos", NULL, "W left out");
    assert_non_null(strstr(said, "A_3.JPG of the same shot is there"));
    assert_null(strstr(said, "A_1.JPG of the same shot"));
    assert_false(fs_file_exists(temp("out/linear/A_3.tif")));
}

// Photos are levelled again where their JPEGs are used after all.
static void test_level_again(void **state)
{
    (void)state;
    PhotoFile photo[3] = {{.file = "a", .gain = 3, .flash_gain = 2, .flash = 1, .kind = PHOTO_JPEG},
                          {.file = "b", .gain = 1, .flash_gain = 1, .flash = 1, .kind = PHOTO_JPEG},
                          {.file = "c", .gain = 1, .flash_gain = 1, .flash = 0, .kind = PHOTO_JPEG}};
    Photos photos = {.photo = photo, .n = 3};
    Log log = {0};
    for (int i = 0; i < 3; i++) photo[i].exif = (ExifInfo){.exposure_s = 0.25, .iso = 100, .f_number = 8};
    photo[2].exif = (ExifInfo){0}; // tells nothing
    photo[2].gain = photo[2].flash_gain = 2;
    assert_int_equal(fs_level_photos(&photos, &log, NULL), 0);
    for (int i = 0; i < 3; i++) assert_true(photo[i].gain == 1 && photo[i].flash_gain == 1);
}

static void test_raw_before_jpeg(void **state)
{
    (void)state;
    FILL(FOUR, {"rgb.jpg", "A_1.JPG"}, {"rgb.jpg", "A_2.jpeg"});
    expect_good("photos", NULL, "2 photos are there as RAW and as JPEG: the RAW files are used");
    assert_non_null(strstr(said, "4 photos: 2 with flash"));
}

static void test_jpeg(void **state)
{
    (void)state;
    FILL({"rgb.jpg", "A.jpg"}, {"progressive.jpg", "B.jpg"}); // flash, turned by 90 degrees, 1/125 s; none, 2 s
    expect_good("photos", NULL, "reduced quality");
    assert_non_null(strstr(said, "another shutter time"));
    assert_non_null(strstr(said, "another size"));
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL), *entry = photo_entry(root, "A");
    assert_string_equal(json_string_value(json_object_get(entry, "quality")), "reduced");
    assert_true(figure(entry, "width") == 16 && figure(entry, "height") == 24);
    json_decref(root);
    Image photo;
    assert_int_equal(fs_tiff_read(temp("out/linear/A.tif"), &photo, NULL), 0);
    assert_true(photo.width == 16 && photo.height == 24);
    double encoded = (40 + 5 * 12 + 3 * 8) / 255.0, linear = pow((encoded + 0.055) / 1.055, 2.4); // stored (12, 8)
    assert_true(fabs(photo.px[(12 * 16 + (15 - 8)) * 3] / linear - 1) < 0.05);
    fs_image_free(&photo);
}

static void test_orientation(void **state)
{
    (void)state;
    FILL({"turned.dng", "A.dng"}, {"turned.dng", "B.dng"});
    expect_good("photos", SET("flash-glob=A*"), "no brighter");
    Image photo;
    assert_int_equal(fs_tiff_read(temp("out/linear/A.tif"), &photo, NULL), 0);
    assert_true(photo.width == 48 && photo.height == 64);
    for (int y = 2; y < 62; y++)
        for (int x = 2; x < 46; x++) // stored (y, 47 - x): the red channel rises along stored x, green along stored y
            if (y < 28 || y > 56) {
                assert_true(fabs(photo.px[(y * 48 + x) * 3] - (0.2 + 0.004 * y)) < 0.004);
                assert_true(fabs(photo.px[(y * 48 + x) * 3 + 1] - (0.2 + 0.003 * (47 - x))) < 0.004);
            }
    fs_image_free(&photo);
}

// A given RAW photo with another exposure in its EXIF: 1/shutter s and an ISO.
static void write_exposed(const char *from, const char *to, unsigned shutter, unsigned iso)
{
    static const unsigned char time[8] = {0x9a, 0x82, 5, 0, 1, 0, 0, 0}; // ExposureTime: one fraction, 1/4
    static const unsigned char speed[8] = {0x27, 0x88, 3, 0, 1, 0, 0, 0};
    char *data;
    size_t size;
    assert_int_equal(fs_file_read(given(from), 1 << 20, &data, &size, NULL), 0);
    char *at = memmem(data, size, time, 8), *iso_at = memmem(data, size, speed, 8);
    assert_true(at && iso_at);
    at = data + ((unsigned char)at[8] | (unsigned char)at[9] << 8);
    assert_memory_equal(at, "\1\0\0\0\4\0\0\0", 8);
    at[4] = (char)shutter;
    iso_at[8] = (char)iso, iso_at[9] = (char)(iso >> 8);
    assert_int_equal(fs_file_write(temp(to), data, size, NULL), 0);
    free(data);
}

// A photo of half the exposure time comes out twice as bright as its file, and is told of.
static void test_exposure(void **state)
{
    (void)state;
    FILL(FOUR, {"gbrg.dng", "A_5.dng"}, {"gbrg.dng", "A_6.dng"});
    write_exposed("ambient.dng", "photos/A_4.DNG", 8, 200);
    expect_good("photos", NULL, "W 1 of 6 photos have another shutter time, ISO or aperture (e.g. A_4.DNG: 1/8 s");
    assert_null(strstr(said, "flash's light"));
    Image a, b;
    assert_int_equal(fs_tiff_read(temp("out/linear/A_2.tif"), &a, NULL), 0);
    assert_int_equal(fs_tiff_read(temp("out/linear/A_4.tif"), &b, NULL), 0);
    for (int i = 0; i < a.width * a.height * 3; i++) assert_true(fabsf(2 * a.px[i] - b.px[i]) < 1e-6f);
    fs_image_free(&a);
    fs_image_free(&b);
}

// A given RAW photo without a tag of its EXIF, told by its number and type.
static void write_lacking(const char *from, const char *to, const char tag[4])
{
    char *data;
    size_t size;
    assert_int_equal(fs_file_read(given(from), 1 << 20, &data, &size, NULL), 0);
    char *at = memmem(data, size, tag, 4);
    assert_non_null(at);
    at[1] = (char)0xff; // a number that means nothing
    assert_int_equal(fs_file_write(temp(to), data, size, NULL), 0);
    free(data);
}

// An aperture or ISO that a photo does not tell is as with the others.
static void test_exposure_half_told(void **state)
{
    (void)state;
    FILL(FOUR, {"flash.dng", "A_5.DNG"}, {"ambient.dng", "A_6.DNG"});
    write_lacking("flash.dng", "photos/A_5.DNG", "\x9d\x82\5");
    write_lacking("ambient.dng", "photos/A_6.DNG", "\x27\x88\3");
    expect_good("photos", NULL, "3 with flash, 3 without");
    assert_null(strstr(said, "another shutter time"));
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL);
    json_t *a = photo_entry(root, "A_5"), *b = photo_entry(root, "A_6");
    assert_true(figure(a, "f_number") == 0 && figure(b, "iso") == 0);
    assert_true(figure(a, "exposure_gain") == 1 && figure(b, "exposure_gain") == 1 && figure(a, "flash_gain") == 1);
    json_decref(root);
}

// 1/2 s at ISO 100 among 1/4 s at ISO 200: the same light of the room, half the flash.
static void test_shutter_and_flash(void **state)
{
    (void)state;
    FILL(FOUR, {"flash.dng", "A_5.DNG"}, {"ambient.dng", "A_6.DNG"});
    write_exposed("flash.dng", "photos/A_5.DNG", 2, 100);
    write_exposed("ambient.dng", "photos/A_6.DNG", 2, 100);
    expect_good("photos", NULL,
                "W 1 of 3 flash photos have another shutter time, which the flash's light does not follow");
    assert_non_null(strstr(said, "A_5.DNG: 0.5 s, ISO 100, "));
    assert_non_null(strstr(said, ": 0.5 times as much of it"));
    assert_null(strstr(said, "median exposure"));
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL);
    assert_true(fabs(figure(photo_entry(root, "A_5"), "flash_gain") - 0.5) < 1e-6);
    assert_true(figure(photo_entry(root, "A_1"), "flash_gain") == 1 &&
                figure(photo_entry(root, "A_6"), "flash_gain") == 1);
    assert_true(figure(photo_entry(root, "A_5"), "exposure_gain") == 1);
    json_decref(root);
}

static void test_cancel(void **state)
{
    (void)state;
    FILL(FOUR);
    FsError err;
    polls_left = 1;
    assert_int_equal(ingest("photos", SET("threads=1"), &err), FS_ERR_CANCELLED);
    polls_left = 1000000;
    assert_true(fs_file_exists(temp("out/linear/A_1.tif")));
    assert_false(fs_file_exists(temp("out/done/ingest.json")));
}

// RAW photos of 24 megapixels: none is ever whole in memory, whatever the number of photos.
static void test_large(void **state)
{
    (void)state;
#ifdef __SANITIZE_ADDRESS__
    skip(); // takes memory of its own
#endif
    Mosaic mosaic = {.width = 6000, .height = 4000, .px = malloc(24000000 * sizeof(uint16_t))};
    assert_non_null(mosaic.px);
    for (int i = 0; i < 24000000; i++) mosaic.px[i] = (uint16_t)(SENSOR_BLACK + i % 6000 / 2 + i / 6000);
    FILL({"flash.dng", "P1.DNG"}, {"ambient.dng", "P2.DNG"});
    for (int i = 0; i < 4; i++) {
        ShotInfo info = {
            .flash = i & 1, .width = 6000, .height = 4000, .focal_mm = 24, .focal_35mm = 24, SHOT_EXPOSURE};
        FilePath path = fs_file_at("%s/photos/P%d.DNG", scratch, i + 1);
        assert_int_equal(fs_dng_write(path.text, &mosaic, &info, NULL), 0);
    }
    free(mosaic.px);
    expect_good("photos", SET("threads=2"), "2 with flash, 2 without");
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    if (usage.ru_maxrss > 380 * 1024) fail_msg("%ld MiB", usage.ru_maxrss / 1024); // a whole one: 480 MB as floats
    Image image;
    assert_int_equal(fs_tiff_read(temp("out/linear/P1.tif"), &image, NULL), 0);
    assert_true(image.width == 1200 && image.height == 800);
    const float *px = image.px + (400 * 1200 + 600) * 3; // the 5 x 5 pixels around (3002, 2002), as shot
    float want = (3002 / 2.0f - 0.25f + 2002) / (SENSOR_WHITE - SENSOR_BLACK);
    assert_true(fabsf(px[1] - want) < 1e-4f);
    fs_image_free(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good),
        cmocka_unit_test(test_again),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_missing),
        cmocka_unit_test(test_fewest),
        cmocka_unit_test(test_flash_state),
        cmocka_unit_test(test_unreadable),
        cmocka_unit_test(test_cut_raw_beside_jpeg),
        cmocka_unit_test(test_level_again),
        cmocka_unit_test(test_raw_before_jpeg),
        cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_orientation),
        cmocka_unit_test(test_exposure),
        cmocka_unit_test(test_exposure_half_told),
        cmocka_unit_test(test_shutter_and_flash),
        cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_large),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

// RAW: scaling, white balance, demosaicing and clipping, for every Bayer pattern, and LibRaw's way for the others.
#include "photos.h"

#include <math.h>
#include <time.h>

#include "base/rng.h"
#include "image/demosaic.h"
#include "image/extent.h"
#include "image/tone.h"
#include "synth/photo_file.h"

static const double white_balance[3] = {2, 1, 1.6};

// What make.py put into the files.
static double light(int x, int y, int c)
{
    return 0.2 + (c == 0 ? 0.004 * x : c == 1 ? 0.003 * y : 0.002 * (x + y));
}

static bool near_square(int x, int y) // the saturated pixels, and those their colours reach
{
    return x >= 40 - 12 && x < 44 + 12 && y >= 20 - 12 && y < 24 + 12;
}

static void test_dng(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        double gain;
    } cases[] = {{"ambient.dng", 1}, {"turned.dng", 1}, {"gbrg.dng", 1}, {"linear.dng", 1}, {"flash.dng", 1.3}};
    for (int i = 0; i < 5; i++) {
        Image picture[2];
        FsError err = {0};
        RawInfo info;
        if (fs_raw_read_info(given(cases[i].file), &info, &err) != 0) fail_msg("%s", err.message);
        assert_true(fabs(info.white_balance[0] - 2) < 1e-5 && fabs(info.white_balance[2] - 1.6) < 1e-5);
        assert_int_equal(info.orientation, i == 1 ? 6 : 1);
        assert_true(info.exposure_s == 0.25 && info.iso == 200 && info.focal_mm == 24);
        if (read_whole(given(cases[i].file), white_balance, false, picture, &err) != 0) fail_msg("%s", err.message);
        assert_int_equal(picture[0].width, 64);
        assert_int_equal(picture[0].height, 48);
        for (int y = 2; y < 46; y++) // mirroring bends a ramp at the border
            for (int x = 2; x < 62; x++)
                for (int c = 0; c < 3 && (i == 3 || !near_square(x, y)); c++) {
                    double want = fmin(cases[i].gain * light(x, y, c), 0.95), got = picture[0].px[(y * 64 + x) * 3 + c];
                    if (fabs(got - want) > 0.004)
                        fail_msg("%s: (%d, %d, %d) is %g, not %g", cases[i].file, x, y, c, got, want);
                }
        for (int y = 0; y < 48; y++)
            for (int x = 0; x < 64; x++) {
                int dx = x < 40 ? 40 - x : x > 43 ? x - 43 : 0, dy = y < 20 ? 20 - y : y > 23 ? y - 23 : 0;
                bool clipped = i != 3 && dx + dy <= 2;
                assert_int_equal(picture[1].px[y * 64 + x] == 1, clipped);
                for (int c = 0; c < 3 && clipped; c++) { // white, where the white balance would make it magenta
                    float v = picture[0].px[(y * 64 + x) * 3 + c];
                    assert_true(v < 1.2f && (v > 0.85f || dx + dy > 0));
                }
            }
        fs_image_free(&picture[0]);
        fs_image_free(&picture[1]);
    }
}

// For a look, a pixel of every cell.
static void test_half(void **state)
{
    (void)state;
    PhotoSizes sizes = {.n = 1, .enough = 32};
    assert_int_equal(fs_raw_read(given("gbrg.dng"), white_balance, false, &sizes, NULL), 0);
    const Image *rgb = &sizes.size[0].rgb;
    assert_true(rgb->width == 32 && rgb->height == 24);
    for (int y = 0; y < 24; y++)
        for (int x = 0; x < 32; x++)
            for (int c = 0; c < 3 && (x < 20 || x >= 22 || y < 10 || y >= 12); c++)
                assert_true(fabs(fs_image_at(rgb, x, y)[c] - light(2 * x, 2 * y, c)) < 0.006);
    for (int i = 0; i < 32 * 24; i++) {
        bool inside = i % 32 >= 20 && i % 32 < 22 && i / 32 >= 10 && i / 32 < 12;
        assert_true(sizes.size[0].clipped.px[i] == (inside ? 1 : 0));
    }
    fs_sizes_free(&sizes);
    sizes.enough = 33; // half is not
    assert_int_equal(fs_raw_read(given("gbrg.dng"), white_balance, false, &sizes, NULL), 0);
    assert_int_equal(rgb->width, 64);
    fs_sizes_free(&sizes);
    Image image;
    static const int enough[] = {0, 25, 24, 12, 7, 3, 1}, width[] = {24, 24, 24, 12, 12, 3, 3};
    for (int i = 0; i < 7; i++) {
        assert_int_equal(fs_jpeg_read_small(given("rgb.jpg"), enough[i], &image, NULL), 0);
        assert_int_equal(image.width, width[i]);
        fs_image_free(&image);
    }
}

// LibRaw's own processing has the same scale as ours.
static void test_plain(void **state)
{
    (void)state;
    Image picture[2];
    assert_int_equal(read_whole(given("ambient.dng"), white_balance, true, picture, NULL), 0);
    for (int y = 4; y < 44; y++)
        for (int x = 4; x < 60; x++)
            for (int c = 0; c < 3 && !near_square(x, y); c++)
                assert_true(fabs(picture[0].px[(y * 64 + x) * 3 + c] - light(x, y, c)) < 0.01);
    assert_true(picture[1].px[22 * 64 + 42] == 1 && picture[1].px[0] == 0);
    fs_image_free(&picture[0]);
    fs_image_free(&picture[1]);
}

enum { W = 97, H = 71 };
typedef struct Grey {
    float mosaic[W * H], rgb[3 * W * H];
} Grey;

static void get_mosaic(const void *user, int y, float *row)
{
    memcpy(row, ((const Grey *)user)->mosaic + y * W, W * sizeof *row);
}

static void put_rgb(void *user, int y, const float *rgb)
{
    memcpy(((Grey *)user)->rgb + 3 * y * W, rgb, 3 * W * sizeof *rgb);
}

// A textured grey scene under noise: nearer to the truth than averaging neighbours, without bias, negatives kept.
static void test_demosaic(void **state)
{
    (void)state;
    static const unsigned char patterns[4][4] = {{0, 1, 1, 2}, {2, 1, 1, 0}, {1, 0, 2, 1}, {1, 2, 0, 1}};
    static Grey grey;
    static const DemosaicRows rows = {get_mosaic, put_rgb, &grey};
    for (int p = 0; p < 4; p++) {
        Rng rng = fs_rng_new(3);
        double sum = 0, error = 0, plain_error = 0;
        int negative = 0;
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                grey.mosaic[y * W + x] = 0.05f * (1 + sinf(1.3f * x + 0.2f * y)) + 0.003f * fs_rng_normal(&rng);
        assert_int_equal(fs_demosaic(&rows, W, H, patterns[p], NULL), 0);
        for (int y = 1; y < H - 1; y++)
            for (int x = 1; x < W - 1; x++) {
                const float *m = grey.mosaic + y * W + x;
                float truth = 0.05f * (1 + sinf(1.3f * x + 0.2f * y)), green = grey.rgb[(y * W + x) * 3 + 1];
                bool is_green = patterns[p][(y & 1) * 2 + (x & 1)] == 1;
                float plain = is_green ? *m : 0.25f * (m[-1] + m[1] + m[-W] + m[W]);
                if (is_green) assert_true(green == *m);
                error += (green - truth) * (green - truth);
                plain_error += (plain - truth) * (plain - truth);
                for (int c = 0; c < 3; c++)
                    sum += grey.rgb[(y * W + x) * 3 + c] - truth, negative += grey.rgb[(y * W + x) * 3 + c] < 0;
            }
        if (error > 0.3 * plain_error) fail_msg("%g %g", error, plain_error);
        assert_true(fabs(sum / (3 * W * H)) < 5e-4);
        assert_true(negative > 100);
    }
    static const unsigned char nonsense[4] = {0, 1, 2, 1};
    assert_int_equal(fs_demosaic(&rows, W, H, nonsense, NULL), FS_ERR_INPUT);
    assert_int_equal(fs_demosaic(&rows, 4, 4, patterns[0], NULL), FS_ERR_INPUT);
}

static void test_errors(void **state)
{
    (void)state;
    Image picture[2];
    RawInfo info;
    FsError err = {0};
    assert_int_equal(read_whole(given("missing.dng"), white_balance, false, picture, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "missing.dng"));
    assert_int_equal(fs_raw_read_info(given("make.py"), &info, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "make.py"));
}

// LibRaw means a square larger than the sensor before it turns the picture.
static void test_super_ccd(void **state)
{
    (void)state;
    Image picture[2];
    RawInfo info;
    FsError err = {0};
    if (fs_raw_read_info(given("super_ccd.raf"), &info, &err) != 0) fail_msg("%s", err.message);
    assert_non_null(strstr(info.model, "T100"));
    if (read_whole(given("super_ccd.raf"), white_balance, false, picture, &err) != 0) fail_msg("%s", err.message);
    assert_true(picture[0].width > 16 && picture[0].height > 16);
    double sum = 0;
    for (size_t i = 0; i < fs_image_values(&picture[0]); i++) sum += picture[0].px[i];
    assert_true(sum > 0);
    fs_image_free(&picture[0]);
    fs_image_free(&picture[1]);
}

static void expect_refused(const char *path, const char *words)
{
    Image picture[2];
    FsError err = {0};
    if (read_whole(path, white_balance, false, picture, &err) != FS_ERR_INPUT || !strstr(err.message, words) ||
        !strstr(err.message, path))
        fail_msg("'%s' is not '%s'", err.message, words);
    assert_null(picture[0].px);
}

static void write_file(const char *name, const void *data, size_t size)
{
    FILE *f = fopen(temp(name), "wb");
    assert_true(f && fwrite(data, 1, size, f) == size && fclose(f) == 0);
}

// A file that ends before its picture is not read, wherever it was cut.
static void test_cut(void **state)
{
    (void)state;
    static const char *const files[] = {"ambient.dng", "linear.dng"};
    for (int i = 0; i < 2; i++) {
        char *data;
        size_t size, strip = i ? 64 * 48 * 6 : 64 * 48 * 2;
        assert_int_equal(fs_file_read(given(files[i]), 1 << 20, &data, &size, NULL), 0);
        for (int k = 0; k < 12; k++) { // the strip lies at the end or before the tags
            write_file("cut.dng", data, k ? size - 1 - (size_t)k * strip / 12 : size);
            if (k) expect_refused(temp("cut.dng"), "");
        }
        free(data);
    }
    // what other makers' files promise: Fujifilm's parts, Canon's boxes, a strip of which a little or much is missing
    unsigned char raf[200] = "FUJIFILMCCD-RAW ",
                  crx[124] = "\0\0\0\x18"
                             "ftypcrx ",
                  nef[2000] = "II*\0\x08\0\0\0\x02";
    raf[103] = 120, raf[107] = 80;
    crx[24 + 3] = 100, memcpy(crx + 28, "mdat", 4);
    static const unsigned char strip[] = {0x11, 1, 4, 0, 1, 0, 0, 0, 100, 0, 0, 0, 0x17, 1, 4, 0, 1, 0, 0, 0, 0x6c, 7};
    memcpy(nef + 10, strip, sizeof strip);
    const struct {
        const char *name;
        const void *data;
        size_t size;
        bool whole;
    } cases[] = {{"a.raf", raf, 200, true},   {"a.raf", raf, 199, false}, {"a.cr3", crx, 124, true},
                 {"a.cr3", crx, 123, false},  {"a.nef", nef, 2000, true}, {"a.nef", nef, 1980, true},
                 {"a.nef", nef, 1900, false}, {"a.kdc", nef, 1900, true}, {"a.jpg", "x", 1, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        FsError err = {0};
        write_file(cases[i].name, cases[i].data, cases[i].size);
        int rc = fs_extent_check(temp(cases[i].name), &err);
        if (rc != (cases[i].whole ? 0 : FS_ERR_INPUT)) fail_msg("%zu: %d %s", i, rc, err.message);
        if (rc) assert_non_null(strstr(err.message, "cut short"));
    }
    assert_int_equal(fs_extent_check(temp("missing.dng"), NULL), 0); // whoever reads it will say so
}

static void put_entry(unsigned char *p, unsigned tag, unsigned type, unsigned count, unsigned value)
{
    const unsigned field[] = {tag | type << 16, count, value};
    for (int i = 0; i < 12; i++) p[i] = (unsigned char)(field[i / 4] >> 8 * (i % 4));
}

// A directory whose next one and ten inner ones are itself, with as many entries and strips as there may be: looked at
// once for each link, this would take a minute.
static void test_circles(void **state)
{
    (void)state;
    enum { ENTRIES = 4000, INNER = 8 + 2 + 12 * ENTRIES + 4, FLOATS = INNER + 40, SIZE = FLOATS + 16 };
    static unsigned char nef[SIZE] = "II*\0\x08";
    nef[8] = ENTRIES & 255, nef[9] = ENTRIES >> 8;
    put_entry(nef + 10, 0x0111, 3, 20000, 8);
    put_entry(nef + 22, 0x0117, 3, 20000, 8);
    for (int i = 2; i < ENTRIES - 1; i++) put_entry(nef + 10 + 12 * i, 0xffff, 3, 1, 0);
    put_entry(nef + 10 + 12 * (ENTRIES - 1), 0x014a, 4, 10, INNER);
    nef[INNER - 4] = 8; // the next one
    for (int i = 0; i < 10; i++) nef[INNER + 4 * i] = 8;
    write_file("a.nef", nef, SIZE);
    clock_t begin = clock();
    assert_true(fs_extent_check(temp("a.nef"), NULL) <= 0);
    assert_true(clock() - begin < 3 * CLOCKS_PER_SEC); // 0.1 s
    // places that are none: before the file's first byte, and beyond what 32 bits tell
    static const float places[] = {-1e30f, 1e30f};
    put_entry(nef + 10 + 12 * (ENTRIES - 1), 0x014a, 11, 2, FLOATS);
    memcpy(nef + FLOATS, places, sizeof places);
    write_file("a.nef", nef, SIZE);
    assert_true(fs_extent_check(temp("a.nef"), NULL) <= 0);
}

// A lossy linear DNG is read; what this LibRaw does not know is said with what would.
static void test_kinds_of_dng(void **state)
{
    (void)state;
    Image picture[2];
    FsError err = {0};
    char *data;
    size_t size;
    if (read_whole(given("lossy.dng"), white_balance, false, picture, &err) != 0) fail_msg("%s", err.message);
    for (int x = 8; x < 64; x += 48) // 60 and 120 of 255, by the curve that is usual without one
        for (int c = 0; c < 3; c++) {
            double want = (double)fs_tone_srgb_decode((x < 32 ? 60 : 120) / 255.0f) * white_balance[c],
                   got = fs_image_at(&picture[0], x, 20)[c];
            if (fabs(got - want) > 0.02) fail_msg("(%d, %d) is %g, not %g", x, c, got, want);
        }
    fs_image_free(&picture[0]);
    fs_image_free(&picture[1]);
    static const unsigned char compression[12] = {3, 1, 3, 0, 1, 0, 0, 0, 0x4c, 0x88};
    static const char *const cases[][2] = {{"a.dng", "JPEG XL, which takes LibRaw 0.22"},
                                           {"a.gpr", "GoPro's GPR SDK"},
                                           {"a.cr3", "LibRaw 0.21"},
                                           {"a.nef", "newer than it"}};
    assert_int_equal(fs_file_read(given("lossy.dng"), 1 << 20, &data, &size, NULL), 0);
    unsigned char *at = memmem(data, size, compression, sizeof compression);
    assert_non_null(at);
    at[8] = 0x42, at[9] = 0xcd;
    for (int i = 0; i < 4; i++) {
        write_file(cases[i][0], data, size);
        expect_refused(temp(cases[i][0]), cases[i][1]);
        expect_refused(temp(cases[i][0]), "convert it to DNG");
    }
    free(data);
}

// Zeros where a damaged file has no data, one value all over.
static void test_empty(void **state)
{
    (void)state;
    enum { WIDTH = 64, HEIGHT = 200 };
    static uint16_t px[WIDTH * HEIGHT];
    Mosaic mosaic = {.width = WIDTH, .height = HEIGHT, .px = px};
    ShotInfo info = {.width = WIDTH, .height = HEIGHT, .focal_mm = 24, .focal_35mm = 24};
    static const struct {
        int filled, value;
        const char *words; // NULL: good
    } cases[] = {{HEIGHT, 0, NULL},
                 {HEIGHT - 3, 0, NULL},
                 {HEIGHT - 3, SENSOR_BLACK, NULL},
                 {HEIGHT - 20, SENSOR_WHITE, NULL}, // a window
                 {HEIGHT - 20, 0, "the last 20 of its 200 rows are empty"},
                 {HEIGHT - 20, SENSOR_BLACK, "the last 20 of its 200 rows"},
                 {0, 0, "all black"},
                 {0, SENSOR_BLACK, "all black"},
                 {0, 5000, "one value"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Rng rng = fs_rng_new(3);
        for (int k = 0; k < WIDTH * HEIGHT; k++)
            px[k] = (uint16_t)(k < cases[i].filled * WIDTH ? SENSOR_BLACK + fs_rng_below(&rng, 5) - 2 : cases[i].value);
        fs_file_remove_tree(temp("a.dng"));
        assert_int_equal(fs_dng_write(temp("a.dng"), &mosaic, &info, NULL), 0);
        Image picture[2];
        FsError err = {0};
        if (cases[i].words) {
            expect_refused(temp("a.dng"), cases[i].words);
            continue;
        }
        if (read_whole(temp("a.dng"), white_balance, false, picture, &err) != 0) fail_msg("%zu: %s", i, err.message);
        fs_image_free(&picture[0]);
        fs_image_free(&picture[1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dng),      cmocka_unit_test(test_half),         cmocka_unit_test(test_plain),
        cmocka_unit_test(test_demosaic), cmocka_unit_test(test_errors),       cmocka_unit_test(test_super_ccd),
        cmocka_unit_test(test_cut),      cmocka_unit_test(test_kinds_of_dng), cmocka_unit_test(test_empty),
        cmocka_unit_test(test_circles),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

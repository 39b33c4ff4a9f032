// EXIF: files that exiftool wrote, and blocks made here where exiftool has no file to start from.
#include "photos.h"

#include <math.h>
#include <stdio.h>
#include <zlib.h>

#include "image/exif.h"

static ExifInfo read_exif(const char *path)
{
    ExifInfo info;
    FsError err = {0};
    if (fs_exif_read(path, &info, &err) != 0) fail_msg("%s", err.message);
    return info;
}

static void test_written_by_exiftool(void **state)
{
    (void)state;
    static const char *const files[] = {"rgb.jpg", "rgb8.tif", "rgb8.png"};
    for (int i = 0; i < 3; i++) {
        ExifInfo info = read_exif(given(files[i]));
        assert_int_equal(info.flash, 25);
        assert_int_equal(fs_exif_flash_fired(&info), 1);
        assert_int_equal(info.orientation, 6);
        assert_true(fabs(info.exposure_s - 1.0 / 125) < 1e-9 && info.f_number == 5.6 && info.iso == 400);
        assert_true(info.focal_mm == 35 && info.focal_35mm == 52);
        assert_string_equal(info.make, "Maker");
        assert_string_equal(info.model, "Camera 1");
        assert_true(info.width == 24 && info.height == 16);
        assert_true(fabs(fs_exif_focal_px(&info, 3600, 2400) - 5200) < 1e-6); // 36 x 24 mm at 100 a mm
    }
    ExifInfo info = read_exif(given("progressive.jpg"));
    assert_int_equal(info.flash, 24);
    assert_int_equal(fs_exif_flash_fired(&info), 0);
    assert_true(info.exposure_s == 2 && info.pixels_per_mm == 4);
    assert_true(fs_exif_focal_px(&info, 24, 16) == 40);
    assert_true(fs_exif_focal_px(&info, 12, 8) == 20);  // someone made it smaller
    assert_true(fs_exif_focal_px(&info, 16, 24) == 40); // upright
    info = read_exif(given("ambient.dng"));
    assert_int_equal(fs_exif_flash_fired(&info), 0);
    assert_true(info.neutral[0] == 0.5 && info.neutral[1] == 1 && info.neutral[2] == 0.625);
}

static void test_without_exif(void **state)
{
    (void)state;
    static const char *const files[] = {"grey8.png", "grey.jpg", "rgb16.tif", "make.py"};
    for (int i = 0; i < 4; i++) {
        ExifInfo info = read_exif(given(files[i]));
        assert_int_equal(fs_exif_flash_fired(&info), -1);
        assert_int_equal(info.orientation, 1);
        assert_true(info.exposure_s == 0 && fs_exif_focal_px(&info, 24, 16) == 0);
    }
    ExifInfo info;
    FsError err;
    assert_int_equal(fs_exif_read(given("missing.jpg"), &info, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "missing.jpg"));
    assert_int_equal(fs_exif_read(PHOTOS, &info, &err), FS_ERR_INPUT);
}

// A TIFF block with the EXIF fields Flash and ExposureTime, in either byte order, and in a camera's layout.
typedef struct Builder {
    unsigned char data[2000];
    size_t n;
    int big;
} Builder;

static void put(Builder *b, uint32_t v, int bytes)
{
    for (int i = 0; i < bytes; i++) b->data[b->n++] = (unsigned char)(v >> 8 * (b->big ? bytes - 1 - i : i));
}

static void put_entry(Builder *b, uint32_t tag, uint32_t type, uint32_t count, uint32_t value)
{
    put(b, tag, 2), put(b, type, 2), put(b, count, 4);
    put(b, value, type == 3 ? 2 : 4);
    if (type == 3) put(b, 0, 2);
}

static void put_head(Builder *b, uint32_t magic)
{
    put(b, b->big ? 0x4d4d : 0x4949, 2);
    put(b, magic, 2);
    put(b, 8, 4);
}

static Builder tiff_block(int big, uint32_t magic, uint32_t flash)
{
    Builder b = {.big = big};
    put_head(&b, magic);
    put(&b, 2, 2);
    put_entry(&b, 0x0112, 3, 1, 8);
    put_entry(&b, 0x8769, 4, 1, 38);
    put(&b, 0, 4);
    assert_int_equal(b.n, 38);
    put(&b, 2, 2);
    put_entry(&b, 0x829a, 5, 1, 68);
    put_entry(&b, 0x9209, 3, 1, flash);
    put(&b, 0, 4);
    assert_int_equal(b.n, 68);
    put(&b, 1, 4), put(&b, 30, 4);
    return b;
}

static void test_flash_values(void **state)
{
    (void)state;
    static const struct {
        uint32_t value;
        int fired;
    } cases[] = {{0, 0},    {1, 1},    {5, 1},    {7, 1},    {8, 0},    {9, 1},    {0xd, 1},  {0xf, 1},  {16, 0},
                 {20, 0},   {24, 0},   {0x19, 1}, {0x1d, 1}, {0x1f, 1}, {32, 0},   {0x41, 1}, {0x45, 1}, {0x47, 1},
                 {0x49, 1}, {0x4d, 1}, {0x50, 0}, {0x58, 0}, {0x59, 1}, {0x5d, 1}, {0x5f, 1}};
    static const uint32_t magics[] = {42, 0x55, 0x4f52, 0x5352};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int big = 0; big < 2; big++) {
            Builder b = tiff_block(big, magics[i % 4], cases[i].value);
            assert_int_equal(fs_file_write(temp("a.nef"), b.data, b.n, NULL), 0);
            ExifInfo info = read_exif(temp("a.nef"));
            assert_int_equal(info.flash, cases[i].value);
            assert_int_equal(fs_exif_flash_fired(&info), cases[i].fired);
            assert_int_equal(info.orientation, 8);
            assert_true(fabs(info.exposure_s - 1.0 / 30) < 1e-9);
        }
}

static void put_bytes(Builder *b, const void *data, size_t n)
{
    memcpy(b->data + b->n, data, n);
    b->n += n;
}

// Canon's CR3: ftyp, moov / uuid / CMT1 (first directory) and CMT2 (EXIF).
static void test_cr3(void **state)
{
    (void)state;
    Builder one = {0}, two = {0}, b = {.big = 1};
    put_head(&one, 42), put(&one, 1, 2), put_entry(&one, 0x0112, 3, 1, 6), put(&one, 0, 4);
    put_head(&two, 42), put(&two, 1, 2), put_entry(&two, 0x9209, 3, 1, 9), put(&two, 0, 4);
    put(&b, 16, 4), put_bytes(&b, "ftypcrx \0\0\0\1", 12);
    uint32_t boxes = (uint32_t)(8 + one.n + 8 + two.n);
    put(&b, 8 + 24 + boxes, 4), put_bytes(&b, "moov", 4);
    put(&b, 24 + boxes, 4), put_bytes(&b, "uuid\x85\xc0\xb6\x87\x82\x0f\x11\xe0\x81\x11\xf4\xce\x46\x2b\x6a\x48", 20);
    put(&b, (uint32_t)(8 + one.n), 4), put_bytes(&b, "CMT1", 4), put_bytes(&b, one.data, one.n);
    put(&b, (uint32_t)(8 + two.n), 4), put_bytes(&b, "CMT2", 4), put_bytes(&b, two.data, two.n);
    assert_int_equal(fs_file_write(temp("a.cr3"), b.data, b.n, NULL), 0);
    ExifInfo info = read_exif(temp("a.cr3"));
    assert_int_equal(info.flash, 9);
    assert_int_equal(info.orientation, 6);
}

// Fujifilm's RAF: a JPEG inside, found by big-endian offset and length at byte 84.
static void test_raf(void **state)
{
    (void)state;
    Builder tiff = tiff_block(0, 42, 0x19), b = {.big = 1};
    put_bytes(&b, "FUJIFILMCCD-RAW 0201", 20);
    b.n = 84;
    put(&b, 100, 4), put(&b, (uint32_t)(2 + 4 + 6 + tiff.n), 4);
    b.n = 100;
    put_bytes(&b, "\xff\xd8\xff\xe1", 4), put(&b, (uint32_t)(8 + tiff.n), 2), put_bytes(&b, "Exif\0\0", 6);
    put_bytes(&b, tiff.data, tiff.n);
    assert_int_equal(fs_file_write(temp("a.raf"), b.data, b.n, NULL), 0);
    assert_int_equal(read_exif(temp("a.raf")).flash, 0x19);
}

// Minolta's MRW: blocks, of which TTW is a TIFF block.
static void test_mrw(void **state)
{
    (void)state;
    Builder tiff = tiff_block(1, 42, 9), b = {.big = 1};
    put_bytes(&b, "\0MRM\0\0\1\0", 8);
    put_bytes(&b, "\0PRD\0\0\0\4abcd", 12);
    put_bytes(&b, "\0TTW", 4), put(&b, (uint32_t)tiff.n, 4), put_bytes(&b, tiff.data, tiff.n);
    assert_int_equal(fs_file_write(temp("a.mrw"), b.data, b.n, NULL), 0);
    assert_int_equal(read_exif(temp("a.mrw")).flash, 9);
    b.n -= 5; // the block ends outside
    assert_int_equal(fs_file_write(temp("a.mrw"), b.data, b.n, NULL), 0);
    assert_int_equal(read_exif(temp("a.mrw")).flash, -1);
}

// EXIF in the text of a PNG, as ImageMagick writes it: hexadecimal, plain or compressed, with "Exif" before it or not.
static void test_png_text(void **state)
{
    (void)state;
    Builder tiff = tiff_block(0, 42, 0x19);
    for (int variant = 0; variant < 8; variant++) {
        bool packed = variant & 1, headed = variant & 2, app1 = variant & 4;
        char text[1000], chunk[1200];
        int n = snprintf(text, sizeof text, "\n%s\n%8zu\n", app1 ? "app1" : "exif", tiff.n + (headed ? 6 : 0));
        if (headed) n += sprintf(text + n, "457869660000\n");
        for (size_t i = 0; i < tiff.n; i++) n += sprintf(text + n, i % 36 == 35 ? "%02x\n" : "%02X", tiff.data[i]);
        int head = sprintf(chunk, "Raw profile type %s", app1 ? "APP1" : "exif") + 1;
        if (packed) chunk[head++] = 0;
        uLongf size = sizeof chunk - (size_t)head;
        if (packed)
            assert_int_equal(compress((Bytef *)chunk + head, &size, (Bytef *)text, (uLong)n), Z_OK);
        else
            memcpy(chunk + head, text, size = (uLongf)n);
        Builder b = {.big = 1};
        put_bytes(&b, "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x20\0\0\0\x10\b\2\0\0\0xxxx", 33);
        put(&b, (uint32_t)(head + (int)size), 4), put_bytes(&b, packed ? "zTXt" : "tEXt", 4);
        put_bytes(&b, chunk, (size_t)head + size), put_bytes(&b, "crc.\0\0\0\0IEND", 12);
        for (size_t kept = b.n; kept + 41 > b.n; kept -= 40) { // whole, and cut short
            assert_int_equal(fs_file_write(temp("a.png"), b.data, kept, NULL), 0);
            ExifInfo info = read_exif(temp("a.png"));
            assert_int_equal(info.flash, kept == b.n ? 0x19 : -1);
            assert_true(info.width == 32 && info.height == 16);
        }
    }
}

static void test_lies(void **state)
{
    (void)state;
    Builder b = {0};
    put_head(&b, 42);
    put(&b, 5, 2);
    put_entry(&b, 0x0112, 3, 1, 77);                  // no such orientation
    put_entry(&b, 0x8769, 4, 1, 8);                   // EXIF is the directory itself
    put_entry(&b, 0x829a, 5, 0xffffffff, 0xfffffff0); // outside
    put_entry(&b, 0x9209, 99, 1, 1);                  // no such type
    put_entry(&b, 0x010f, 2, 0xffffffff, 8);          // endless text
    assert_int_equal(fs_file_write(temp("a.tif"), b.data, b.n, NULL), 0);
    ExifInfo info = read_exif(temp("a.tif"));
    assert_int_equal(info.orientation, 1);
    assert_int_equal(info.flash, -1);
    assert_true(info.exposure_s == 0);
    // Nonsense resolutions give way to the 35 mm equivalent.
    info = (ExifInfo){.focal_mm = 50, .focal_35mm = 50, .pixels_per_mm = 1e6};
    assert_true(fabs(fs_exif_focal_px(&info, 3600, 2400) - 5000) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_written_by_exiftool),
        cmocka_unit_test(test_without_exif),
        cmocka_unit_test(test_flash_values),
        cmocka_unit_test(test_cr3),
        cmocka_unit_test(test_raf),
        cmocka_unit_test(test_mrw),
        cmocka_unit_test(test_png_text),
        cmocka_unit_test(test_lies),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

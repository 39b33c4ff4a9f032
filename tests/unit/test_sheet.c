// Contact sheets and their font: where tiles land, that labels leave ink, and what is refused.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>

#include "image/font.h"
#include "image/sheet.h"
#include "temp_dir.h"

static Image filled(int width, int height, int channels, float value)
{
    Image image;
    assert_int_equal(fs_image_new(&image, width, height, channels, NULL), 0);
    for (int i = 0; i < width * height * channels; i++) image.px[i] = value;
    return image;
}

static const float *at(const Image *image, int x, int y)
{
    return image->px + (y * image->width + x) * image->channels;
}

static void tiles_land_in_the_grid(void **state)
{
    char *path = fs_file_path("%s/sheet.png", (const char *)*state);
    Image color = filled(20, 10, 3, 0.25f), grey = filled(30, 8, 1, 0.75f), sheet;
    SheetTile tiles[] = {{&color, NULL}, {&grey, NULL}, {NULL, NULL}, {&color, NULL}, {&grey, NULL}};
    assert_int_equal(fs_sheet_write(path, tiles, 5, 2, NULL), 0);
    assert_int_equal(fs_png_read(path, &sheet, NULL), 0);
    // margins of 6; columns 30 (grey below color) and 30 wide, rows 10, 10 and 8 high
    assert_int_equal(sheet.width, 6 + 30 + 6 + 30 + 6);
    assert_int_equal(sheet.height, 6 + 10 + 6 + 10 + 6 + 8 + 6);
    assert_float_equal(at(&sheet, 6, 6)[0], 0.25f, 0.003f);
    assert_float_equal(at(&sheet, 25, 15)[2], 0.25f, 0.003f);
    assert_float_equal(at(&sheet, 42, 6)[1], 0.75f, 0.003f); // grey fills all channels
    assert_float_equal(at(&sheet, 42, 22)[1], 0.25f, 0.003f);
    assert_float_equal(at(&sheet, 6, 38)[2], 0.75f, 0.003f);
    assert_true(at(&sheet, 10, 25)[0] < 0.15f); // the empty tile
    fs_image_free(&color);
    fs_image_free(&grey);
    fs_image_free(&sheet);
    free(path);
}

static int ink(const Image *image, int x0, int x1)
{
    int n = 0;
    for (int y = 0; y < image->height; y++)
        for (int x = x0; x < x1; x++) n += at(image, x, y)[0] > 0.5f;
    return n;
}

static void labels_leave_ink_inside_their_column(void **state)
{
    (void)state;
    Image dark = filled(40, 10, 3, 0), sheet;
    SheetTile plain[] = {{&dark, NULL}, {&dark, NULL}}, labelled[] = {{&dark, "T_N of a very long name"}, {&dark, ""}};
    assert_int_equal(fs_sheet_draw(&sheet, plain, 2, 2, NULL), 0);
    int height = sheet.height;
    assert_int_equal(ink(&sheet, 0, sheet.width), 0);
    fs_image_free(&sheet);
    assert_int_equal(fs_sheet_draw(&sheet, labelled, 2, 2, NULL), 0);
    assert_int_equal(sheet.height, height + FS_FONT_HEIGHT + 3);
    assert_true(ink(&sheet, 6, 46) > 30);
    assert_int_equal(ink(&sheet, 46, sheet.width), 0);
    fs_image_free(&sheet);
    fs_image_free(&dark);
}

static void every_character_has_a_glyph_of_its_own(void **state)
{
    (void)state;
    const float white[3] = {1, 1, 1};
    Image picture[95];
    for (int c = 0; c < 95; c++) {
        picture[c] = filled(6, 9, 1, 0);
        fs_font_draw(&picture[c], 0, 0, 6, 1, white, (char[]){(char)(32 + c), 0});
        assert_int_equal(ink(&picture[c], 0, 6) == 0, c == 0);
        for (int d = 0; d < c; d++) assert_true(memcmp(picture[c].px, picture[d].px, 54 * sizeof(float)) != 0);
    }
    for (int c = 0; c < 95; c++) fs_image_free(&picture[c]);
    Image odd = filled(20, 9, 1, 0), plain = filled(20, 9, 1, 0); // e acute is one character, a stray byte another
    fs_font_draw(&odd, 0, 0, 20, 1, white, "\xc3\xa9\xff");
    fs_font_draw(&plain, 0, 0, 20, 1, white, "??");
    assert_memory_equal(odd.px, plain.px, 20 * 9 * sizeof(float));
    fs_image_free(&odd);
    fs_image_free(&plain);
    Image small = filled(3, 3, 3, 0); // drawing over the edges stays inside
    fs_font_draw(&small, -4, -5, 100, 3, white, "W\xf0\x9f");
    fs_font_draw(&small, 2, 2, 100, 5, white, "##");
    fs_image_free(&small);
}

static void bad_sheets_are_refused(void **state)
{
    FsError err = {0};
    Image tile = filled(FS_IMAGE_MAX_SIDE / 2, 1, 1, 0), sheet;
    SheetTile tiles[] = {{&tile, NULL}, {&tile, NULL}, {&tile, NULL}};
    assert_int_equal(fs_sheet_draw(&sheet, tiles, 3, 3, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "3 tiles"));
    assert_null(sheet.px);
    assert_int_equal(fs_sheet_draw(&sheet, tiles, 0, 3, &err), FS_ERR_INPUT);
    assert_int_equal(fs_sheet_draw(&sheet, tiles, 3, 0, &err), FS_ERR_INPUT);
    char *path = fs_file_path("%s/no/such/sheet.png", (const char *)*state);
    assert_int_equal(fs_sheet_write(path, tiles, 1, 1, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, path));
    free(path);
    fs_image_free(&tile);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(tiles_land_in_the_grid, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(labels_leave_ink_inside_their_column),
        cmocka_unit_test(every_character_has_a_glyph_of_its_own),
        cmocka_unit_test_setup_teardown(bad_sheets_are_refused, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

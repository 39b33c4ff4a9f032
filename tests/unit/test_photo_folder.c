// Photos as people keep them: in subfolders, under any names, twice.
#include "ingest_run.h"

#include "synth/photo_file.h"

// The view's flash state, as ingest wrote it.
static void expect_view(const char *name, const char *file, bool flash)
{
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL), *entry = photo_entry(root, name);
    assert_string_equal(json_string_value(json_object_get(entry, "file")), file);
    assert_int_equal(json_is_true(json_object_get(entry, "flash")), flash);
    assert_true(fs_file_exists(fs_file_at("%s/out/linear/%s.tif", scratch, name).text));
    json_decref(root);
}

static void test_subfolders(void **state)
{
    (void)state;
    FILL({"flash.dng", "DCIM/100CANON/IMG_1.DNG"}, {"ambient.dng", "DCIM/100CANON/IMG_2.DNG"},
         {"ambient.dng", "DCIM/101CANON/IMG_3.DNG"}, {"make.py", "MISC/notes.txt"});
    expect_good("photos", NULL, "no photos; 3 in its subfolders are taken");
    assert_non_null(strstr(said, "1 with flash, 2 without (EXIF)"));
    expect_view("IMG_3", "DCIM/101CANON/IMG_3.DNG", false);
    expect_good("photos", NULL, "skipped");
    copy_photo("flash.dng", "photos/DCIM/100CANON/IMG_2.DNG"); // what lies there counts
    expect_good("photos", NULL, "2 with flash, 1 without");
    // a folder that has photos of its own is not left
    copy_photo("flash.dng", "photos/A.DNG");
    copy_photo("ambient.dng", "photos/B.DNG");
    expect_good("photos", NULL, "1 with flash, 1 without");
    // the camera began to count again
    FILL({"flash.dng", "100CANON/IMG_1.DNG"}, {"ambient.dng", "101CANON/IMG_1.DNG"});
    expect_good("photos", NULL, "1 with flash");
    expect_view("100CANON_IMG_1", "100CANON/IMG_1.DNG", true);
    expect_view("101CANON_IMG_1", "101CANON/IMG_1.DNG", false);
    FILL({"flash.dng", "100CANON/IMG_1.DNG"}, {"rgb.jpg", "101CANON/IMG_1.JPG"}, {"ambient.dng", "100CANON/IMG_2.DNG"});
    expect_good("photos", NULL, "2 with flash, 1 without");
    // the two files of one shot
    FILL({"flash.dng", "raw/IMG_1.DNG"}, {"ambient.dng", "raw/IMG_2.DNG"}, {"rgb.jpg", "jpeg/IMG_1.JPG"});
    expect_good("photos", NULL, "1 photos are there as RAW and as JPEG");
    assert_non_null(
        strstr(said, "W 1 photos are left out for their names alone (e.g. jpeg/IMG_1.JPG beside raw/IMG_1.D"));
    // what other programs left beside them
    FILL({"flash.dng", "IMG_1.DNG"}, {"ambient.dng", "IMG_2.DNG"}, {"make.py", "IMG_1.npy"});
    expect_good("photos", NULL, "1 .npy files beside photos are not taken for photos");
    expect_view("IMG_1", "IMG_1.DNG", true);
    FILL({"make.py", "a/notes.txt"}, {"flash.dng", "a/b/c/d/too deep.dng"});
    expect_error("photos", NULL, "no photos");
}

// What lies beside photos and is none: folders, whatever their names, small pictures of network drives, a cover.
static void test_folders_beside(void **state)
{
    (void)state;
    FILL({"flash.dng", "IMG_1.DNG"}, {"ambient.dng", "IMG_2.DNG"}, {"make.py", "IMG_3.JPG/notes.txt"});
    expect_good("photos", NULL, "1 with flash, 1 without");
    assert_null(strstr(said, "left out"));
    FILL({"flash.dng", "flash/IMG_1.DNG"}, {"ambient.dng", "noflash/IMG_2.DNG"},
         {"rgb.jpg", "flash/@eaDir/IMG_1.DNG/SYNOPHOTO_THUMB_M.jpg"}, {"rgb.jpg", "__MACOSX/a.jpg"});
    expect_good("photos", NULL, "2 in its subfolders are taken");
    assert_null(strstr(said, "left out"));
    FILL({"flash.dng", "flash/IMG_1.DNG"}, {"ambient.dng", "noflash/IMG_2.DNG"}, {"rgb.jpg", "cover.jpg"});
    expect_good("photos", NULL, "W ");
    assert_non_null(strstr(said, "one photo, cover.jpg, which is left out: the 2 in its subfolders are taken"));
    assert_non_null(strstr(said, "2 photos: 1 with flash"));
}

// The two files of a shot, as cameras, phones and people call them.
static void test_pairs(void **state)
{
    (void)state;
    FILL({"flash.dng", "IMG_1.DNG"}, {"rgb.jpg", "img_1.jpg"}, {"ambient.dng", "PXL_2024_10.RAW-02.ORIGINAL.dng"},
         {"rgb.jpg", "PXL_2024_10.RAW-01.COVER.jpg"}, {"ambient.dng", "PXL_2024_11.dng"},
         {"rgb.jpg", "PXL_2024_11.MP.jpg"});
    expect_good("photos", NULL, "3 photos are there as RAW and as JPEG");
    assert_non_null(strstr(said, "3 photos: 1 with flash"));
    expect_view("PXL_2024_10.RAW-02.ORIGINAL", "PXL_2024_10.RAW-02.ORIGINAL.dng", false);
}

// RAW files that cannot be read do not take their JPEGs with them.
static void test_unreadable_raw(void **state)
{
    (void)state;
    FILL({"make.py", "IMG_1.CR3"}, {"rgb.jpg", "IMG_1.JPG"}, {"make.py", "IMG_2.CR3"}, {"rgb.jpg", "img_2.jpg"},
         {"flash.dng", "IMG_3.DNG"}, {"rgb.jpg", "IMG_3.JPG"});
    expect_good("photos", SET("flash-glob=*1.*"), "W 2 of 3 files cannot be read");
    expect_view("IMG_1", "IMG_1.JPG", true);
    expect_view("IMG_2", "img_2.jpg", false);
    expect_view("IMG_3", "IMG_3.JPG", false); // of one kind with the others
    expect_good("photos", SET("flash-glob=*1.*"), "skipped");
    // data that cannot be read behind a good header
    char *data;
    size_t size;
    assert_int_equal(fs_file_read(given("flash.dng"), 1 << 20, &data, &size, NULL), 0);
    FILL({"rgb.jpg", "IMG_1.JPG"}, {"rgb.jpg", "IMG_2.JPG"}, {"flash.dng", "IMG_3.DNG"}, {"rgb.jpg", "IMG_3.JPG"});
    for (int i = 1; i < 3; i++) {
        FilePath cut = fs_file_at("%s/photos/IMG_%d.DNG", scratch, i);
        assert_int_equal(fs_file_write(cut.text, data, size * 2 / 3, NULL), 0);
    }
    free(data);
    expect_good("photos", SET("flash-glob=*1.*"), "W 2 of 3 files cannot be read");
    expect_view("IMG_3", "IMG_3.JPG", false);
    // where few fail, RAW is worth more than they are
    FILL({"flash.dng", "IMG_1.DNG"}, {"ambient.dng", "IMG_2.DNG"}, {"ambient.dng", "IMG_3.DNG"},
         {"make.py", "IMG_4.DNG"}, {"rgb.jpg", "IMG_4.JPG"});
    expect_good("photos", NULL, "W left out: ");
    assert_non_null(strstr(said, "4 photos: 1 with flash") ? said : strstr(said, "3 photos: 1 with flash"));
}

// "IMG (2)" comes before "IMG (10)".
static void test_order(void **state)
{
    (void)state;
    FILL({"flash.dng", "P 10.DNG"}, {"ambient.dng", "P 9.DNG"}, {"ambient.dng", "P 100.DNG"}, {"flash.dng", "P 1.DNG"});
    expect_good("photos", NULL, "2 with flash");
    static const char *const order[] = {"P 1", "P 9", "P 10", "P 100"};
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL), *photos = json_object_get(root, "photos");
    for (size_t i = 0; i < 4; i++)
        assert_string_equal(json_string_value(json_object_get(json_array_get(photos, i), "name")), order[i]);
    json_decref(root);
}

static void test_own_results_are_no_photos(void **state)
{
    (void)state;
    FILL({"flash.dng", "IMG_1.DNG"}, {"ambient.dng", "IMG_2.DNG"});
    expect_good("photos", NULL, "1 with flash");
    expect_error("out", NULL, "no photos");
    expect_good("", NULL, "2 in its subfolders are taken"); // those beside the results
}

static void test_folders_that_say_flash(void **state)
{
    (void)state;
    static const char *const names[][2] = {{"flash", "noflash"}, {"Flash", "No-Flash"}, {"with flash", "ambient"}};
    for (int i = 0; i < 3; i++) {
        char file[4][60];
        for (int k = 0; k < 4; k++) snprintf(file[k], sizeof file[k], "%s/%d.tif", names[i][k & 1], 1 + k / 2);
        FILL({"rgb16.tif", file[0]}, {"rgb16.tif", file[1]}, {"rgb16.tif", file[2]}, {"rgb16.tif", file[3]});
        expect_good("photos", NULL, "2 with flash, 2 without (their folders)");
        expect_view(i == 0 ? "flash_1" : i == 1 ? "Flash_1" : "with flash_1", file[0], true);
        expect_view(i == 0 ? "noflash_2" : i == 1 ? "No-Flash_2" : "ambient_2", file[3], false);
    }
    static const char *const others[][2] = {{"Blitz", "ohne Blitz"},      {"mit_Blitz", "Kein Blitz"},
                                            {"avec flash", "Sans Flash"}, {"Flash an", "flash aus"},
                                            {"con flash", "sin flash"},   {"Flash Fotos", "Senza flash 2"},
                                            {"met flits", "zonder-flits"}};
    for (int i = 0; i < 7; i++) {
        char file[2][60];
        for (int k = 0; k < 2; k++) snprintf(file[k], sizeof file[k], "%s/%d.tif", others[i][k], 1 + k);
        FILL({"rgb16.tif", file[0]}, {"rgb16.tif", file[1]});
        expect_good("photos", NULL, "1 with flash, 1 without (their folders)");
        expect_view("1", file[0], true);
    }
    FILL({"rgb16.tif", "blitzen/1.tif"}, {"rgb16.tif", "Flash Gordon/2.tif"});
    expect_error("photos", NULL, "none of the 2 photos tells");
    FILL({"flash.dng", "flash/A.DNG"}, {"ambient.dng", "flash/B.DNG"}, {"ambient.dng", "noflash/C.DNG"});
    expect_good("photos", NULL, "W the folders of 1 photos say the opposite of their EXIF (e.g. flash/B.DNG)");
    assert_non_null(strstr(said, "2 with flash, 1 without"));
    expect_good("photos", SET("flash-glob=A*"), "1 with flash, 2 without (--flash-glob)"); // the user's word
    assert_int_equal(fs_file_write(temp("list.txt"), "b.jpg\n", 6, NULL), 0);
    char setting[600];
    snprintf(setting, sizeof setting, "flash-list=%s", temp("list.txt"));
    expect_good("photos", SET(setting), "1 with flash, 2 without (--flash-list)");
    expect_view("B", "flash/B.DNG", true);
    expect_good("photos", SET(setting, "flash-glob=A*"), "2 with flash, 1 without (--flash-glob and --flash-list)");
    expect_view("A", "flash/A.DNG", true);
    // a name that two photos have
    FILL({"flash.dng", "x/A.DNG"}, {"ambient.dng", "y/A.DNG"});
    assert_int_equal(fs_file_write(temp("list.txt"), "A.DNG\n", 6, NULL), 0);
    expect_error("photos", SET(setting), "may be 2 photos");
    assert_int_equal(fs_file_write(temp("list.txt"), "x/A.DNG\n", 8, NULL), 0);
    expect_good("photos", SET(setting), "1 with flash, 1 without");
}

// What breaks lines of COLMAP's text files, or its own names, is in no view's name, and in no message.
static void test_names_that_break_lines(void **state)
{
    (void)state;
    FILL({"flash.dng", "A\n1.DNG"}, {"ambient.dng", "B\\2.DNG"}, {"flash.dng", "C\x1b[31m\t.DNG"},
         {"ambient.dng", "D\x85.DNG"}, {"flash.dng", " E e.DNG"}, {"make.py", "odd\nnotes.txt"});
    expect_good("photos", NULL, "3 with flash, 2 without");
    expect_view("A_1", "A\n1.DNG", true);
    expect_view("_E e", " E e.DNG", true);
    expect_view("B_2", "B\\2.DNG", false);
    expect_view("C_[31m_", "C\x1b[31m\t.DNG", true);
    expect_view("D__", "D\xc2\x85.DNG", false);
    assert_null(strstr(said, "odd\n"));
    assert_non_null(strstr(said, "odd notes"));
    FILL({"flash.dng", "A\n1.DNG"}, {"ambient.dng", "A_1.DNG"});
    expect_error("photos", NULL, "A?1.DNG and A_1.DNG would both become the view A_1: rename");
}

static void test_names_that_say_flash(void **state)
{
    (void)state;
    FILL({"rgb16.tif", "IMG_1_flash.tif"}, {"rgb16.tif", "IMG_2_noflash.tif"}, {"rgb16.tif", "3 No Flash.tif"},
         {"rgb16.tif", "Flash-4.tif"}, {"rgb16.tif", "IMG_5_non_flash.tif"}, {"rgb16.tif", "reflashed.tif"});
    expect_good("photos", NULL, "5 photos: 2 with flash, 3 without (their names)");
    assert_non_null(strstr(said, "W left out: "));
    expect_view("3 No Flash", "3 No Flash.tif", false);
    expect_view("Flash-4", "Flash-4.tif", true);
    expect_view("IMG_5_non_flash", "IMG_5_non_flash.tif", false);
    FILL({"rgb16.tif", "a_flash0002.tif"}, {"rgb16.tif", "a_noflash0001.tif"}, {"rgb16.tif", "no_flash3.tif"});
    expect_good("photos", NULL, "3 photos: 1 with flash, 2 without (their names)");
    FILL({"rgb16.tif", "1 avec flash.tif"}, {"rgb16.tif", "1 sans flash.tif"}, {"rgb16.tif", "2_ohne_Blitz.tif"});
    expect_good("photos", NULL, "3 photos: 1 with flash, 2 without (their names)");
    FILL({"flash.dng", "A_noflash.DNG"}, {"ambient.dng", "B_flash.DNG"}); // EXIF knows better
    expect_good("photos", NULL, "1 with flash, 1 without (EXIF)");
    expect_view("A_noflash", "A_noflash.DNG", true);
    FILL({"rgb16.tif", "1.tif"}, {"rgb16.tif", "2.tif"});
    expect_error("photos", NULL, "_flash in its name");
    expect_good("photos", SET("separation=flashless"), "2 photos do not tell whether the flash fired");
}

static void test_scene_folder(void **state)
{
    (void)state;
    FILL({"rgb16.tif", "images/a_flash.tif"}, {"rgb16.tif", "images/a_noflash.tif"}, {"make.py", "poses_bounds.npy"},
         {"rgb16.tif", "images_4/a_flash.tif"}, {"rgb16.tif", "images_4/a_noflash.tif"},
         {"rgb16.tif", "30_views/dense/images/a_flash.tif"});
    expect_good("photos", NULL, "2 photos: 1 with flash, 1 without (their names)");
    expect_view("a_flash", "images/a_flash.tif", true);
    // a picture beside them is none of them; as many as they are would be the photos
    FILL({"rgb16.tif", "images/a_flash.tif"}, {"rgb16.tif", "images/a_noflash.tif"}, {"make.py", "poses_bounds.npy"},
         {"rgb16.tif", "trimesh.tif"});
    expect_good("photos", NULL, "2 photos: 1 with flash, 1 without (their names)");
    FILL({"rgb16.tif", "images/a_flash.tif"}, {"rgb16.tif", "images/a_noflash.tif"}, {"make.py", "poses_bounds.npy"},
         {"rgb16.tif", "b_flash.tif"}, {"rgb16.tif", "b_noflash.tif"});
    expect_good("photos", NULL, "2 photos: 1 with flash, 1 without (their names)");
    expect_view("b_flash", "b_flash.tif", true);
    FILL({"rgb16.tif", "images/a_flash.tif"}, {"rgb16.tif", "images/a_noflash.tif"}, {"make.py", "poses_bounds.npy"},
         {"rgb16.tif", "images_4/a_flash.tif"}, {"rgb16.tif", "images_4/a_noflash.tif"},
         {"rgb16.tif", "30_views/dense/images/a_flash.tif"});
    // without poses it is a folder with subfolders like any other
    fs_file_remove_tree(temp("photos/poses_bounds.npy"));
    fs_file_remove_tree(temp("photos/30_views"));
    fs_file_remove_tree(temp("out"));
    expect_good("photos", NULL, "4 in its subfolders are taken");
}

static void test_names(void **state)
{
    (void)state;
    char lengthy[2][260], view[200];
    for (int i = 0; i < 2; i++) { // differ at their ends only
        memset(lengthy[i], 'x', 250);
        snprintf(lengthy[i] + 250, 10, "%d.DNG", i);
    }
    FILL({"flash.dng", "caf\xe9 \xff.DNG"}, {"ambient.dng", "\xe2\x82\xac \xc3\xa9.DNG"}, {"ambient.dng", lengthy[0]},
         {"flash.dng", lengthy[1]});
    expect_good("photos", NULL, "2 with flash, 2 without");
    expect_view("caf\xc3\xa9 \xc3\xbf", "caf\xc3\xa9 \xc3\xbf.DNG", true);
    expect_view("\xe2\x82\xac \xc3\xa9", "\xe2\x82\xac \xc3\xa9.DNG", false);
    json_t *root = json_load_file(temp("out/ingest.json"), 0, NULL);
    for (int i = 0, seen = 0; i < 4; i++) {
        const char *name =
            json_string_value(json_object_get(json_array_get(json_object_get(root, "photos"), i), "name"));
        if (name[0] != 'x') continue;
        assert_true(strlen(name) < 170);
        if (seen++) assert_string_not_equal(name, view);
        snprintf(view, sizeof view, "%s", name);
    }
    json_decref(root);
}

static void test_copies(void **state)
{
    (void)state;
    FILL({"flash.dng", "IMG_1.DNG"}, {"ambient.dng", "IMG_2.DNG"}, {"flash.dng", "IMG_1 (1).DNG"},
         {"ambient.dng", "IMG_2 copy.DNG"}, {"ambient.dng", "IMG_2 - Copy (2).DNG"}, {"flash.dng", "Copy of IMG_1.DNG"},
         {"rgb.jpg", "IMG_1.JPG"}, {"rgb.jpg", "IMG_1(2).jpg"});
    expect_good("photos", NULL, "5 photos are copies of others");
    assert_non_null(strstr(said, "2 photos: 1 with flash, 1 without"));
    assert_null(strstr(said, "another version"));
    char setting[600];
    snprintf(setting, sizeof setting, "flash-list=%s", temp("list.txt"));
    assert_int_equal(fs_file_write(temp("list.txt"), "IMG_1.DNG\nIMG_1 (1).DNG\n", 24, NULL), 0);
    expect_good("photos", SET(setting), "1 with flash, 1 without (--flash-list)");
    assert_int_equal(fs_file_write(temp("list.txt"), "IMG_1 (1).DNG\n", 14, NULL), 0);
    expect_good("photos", SET(setting), "1 with flash, 1 without (--flash-list)");
    assert_int_equal(fs_file_write(temp("list.txt"), "IMG_1.DNG\nIMG_1 (7).DNG\n", 24, NULL), 0);
    expect_error("photos", SET(setting), "'IMG_1 (7).DNG' is no photo");
    // one that is not the same, and names that only look like copies
    FILL({"flash.dng", "IMG_1.DNG"}, {"gbrg.dng", "IMG_1 (1).DNG"}, {"ambient.dng", "Glass (1).DNG"},
         {"flash.dng", "Glass (2).DNG"}, {"flash.dng", "copy.DNG"}, {"ambient.dng", "(3).DNG"});
    expect_good("photos", NULL, "W IMG_1 (1).DNG seems to be another version of IMG_1.DNG");
    assert_non_null(strstr(said, "6 photos: 3 with flash"));
}

// A photo of 64 x 64 with the time of the shot of that number.
static void put_shot(const char *name, int number)
{
    static uint16_t px[64 * 64];
    const char *path = temp(name);
    ShotInfo info = {true, number, 64, 64, 24, 24, SHOT_EXPOSURE};
    if (strstr(name, ".DNG")) {
        for (int i = 0; i < 64 * 64; i++) px[i] = (uint16_t)(SENSOR_BLACK + 100 + i % 61);
        assert_int_equal(fs_dng_write(path, &(Mosaic){.width = 64, .height = 64, .px = px}, &info, NULL), 0);
    } else {
        Image picture;
        assert_int_equal(fs_jpeg_read(given("grey.jpg"), &picture, NULL), 0);
        assert_int_equal(fs_photo_file_write_jpeg(path, &picture, &info, NULL), 0);
        fs_image_free(&picture);
    }
}

// What has the name of another's JPEG or copy is left out only when it was taken at the same time.
static void test_times(void **state)
{
    (void)state;
    FILL({"ambient.dng", "raw/A.DNG"}, {"ambient.dng", "jpeg/B.DNG"});
    put_shot("photos/raw/IMG_1.DNG", 1);
    put_shot("photos/jpeg/IMG_1.JPG", 1);
    expect_good("photos", NULL, "1 photos are there as RAW and as JPEG");
    assert_null(strstr(said, "names alone"));
    put_shot("photos/jpeg/IMG_1.JPG", 2);
    expect_good("photos", NULL, "4 photos: 2 with flash, 2 without");
    FILL({"ambient.dng", "A.DNG"});
    put_shot("photos/IMG_1.DNG", 1);
    put_shot("photos/IMG_1 (1).JPG", 1);
    expect_good("photos", NULL, "1 photos are copies of others");
    put_shot("photos/IMG_1 (1).JPG", 2);
    expect_good("photos", NULL, "W IMG_1 (1).JPG seems to be another version of IMG_1.DNG");
    assert_non_null(strstr(said, "3 photos: 2 with flash"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_subfolders),
        cmocka_unit_test(test_folders_beside),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_unreadable_raw),
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_own_results_are_no_photos),
        cmocka_unit_test(test_names_that_break_lines),
        cmocka_unit_test(test_names_that_say_flash),
        cmocka_unit_test(test_scene_folder),
        cmocka_unit_test(test_folders_that_say_flash),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_copies),
        cmocka_unit_test(test_times),
    };
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}

// The page at the end: made from whatever is there, closed in itself, names escaped.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>

#include "../unit/said.h"
#include "../unit/temp_dir.h"
#include "base/owned.h"
#include "image/image.h"
#include "info/info.h"
#include "model/dataset.h"
#include "report/report.h"

#define WIDTH 30
#define HEIGHT 20
static const char *const names[] = {"a<b>&\"c", "plain", "with space", "z'%"};

static void put_image(const char *out, const char *folder, const char *name, const char *suffix, int channels,
                      float value)
{
    Image image;
    char *dir = fs_file_path("%s/%s", out, folder), *path = fs_file_path("%s/%s/%s%s", out, folder, name, suffix);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_image_new(&image, WIDTH, HEIGHT, channels, NULL), 0);
    for (int i = 0; i < WIDTH * HEIGHT * channels; i++) image.px[i] = value;
    assert_int_equal(
        strcmp(suffix, ".tif") ? fs_png_write(path, &image, 8, NULL) : fs_tiff_write_float(path, &image, NULL), 0);
    fs_image_free(&image);
    free(dir);
    free(path);
}

static void put_text(const char *out, const char *name, const char *text)
{
    char *path = fs_file_path("%s/%s", out, name);
    assert_int_equal(fs_file_write(path, text, strlen(text), NULL), 0);
    free(path);
}

static void put_views(const char *out)
{
    Dataset data = {0};
    for (int i = 0; i < 4; i++) {
        View view = {.name = (char *)names[i],
                     .flash = i % 2,
                     .camera = {WIDTH, HEIGHT, 30, 30, 15, 10, {1, 0, 0, -0.1 * i, 0, 1, 0, 0, 0, 0, 1, 0}}};
        assert_int_equal(fs_dataset_append(&data, &view, NULL), 0);
    }
    char *path = fs_file_path("%s/views.json", out);
    assert_int_equal(fs_dataset_write(&data, path, NULL), 0);
    free(path);
    fs_dataset_free(&data);
}

static int report(const char *out, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    FsProject *project;
    assert_int_equal(fs_settings_set(settings, "flash-glob", "<script>*", NULL), 0);
    assert_int_equal(fs_project_open(&project, out, settings, NULL, err), 0);
    int rc = fs_report_run(project, err);
    fs_project_close(project);
    fs_settings_free(settings);
    return rc;
}

static char *page(const char *out)
{
    char *path = fs_file_path("%s/index.html", out), *text;
    size_t size;
    assert_int_equal(fs_file_read(path, 1 << 24, &text, &size, NULL), 0);
    free(path);
    return text;
}

static int hex(char c)
{
    return c <= '9' ? c - '0' : c - 'A' + 10;
}

// Every file that an attribute names is there.
static int check_links(const char *out, const char *text, const char *attribute)
{
    int n = 0;
    for (const char *p = text; (p = strstr(p, attribute)); n++) {
        char name[300], *to = name;
        for (p += strlen(attribute); *p != '"' && to < name + 299; p++)
            if (*p == '%') {
                *to++ = (char)(16 * hex(p[1]) + hex(p[2]));
                p += 2;
            } else {
                *to++ = *p;
            }
        *to = 0;
        char *path = fs_file_path("%s/%s", out, name);
        if (!fs_file_exists(path)) fail_msg("%s%s: not there", attribute, name);
        free(path);
    }
    return n;
}

static void the_page_shows_what_is_there(void **state)
{
    const char *out = *state;
    put_views(out);
    for (int i = 0; i < 4; i++) {
        put_image(out, "images", names[i], ".tif", 3, 0.2f);
        put_image(out, "images", names[i], "_mask.png", 1, 1);
        put_image(out, "renders/T_N", names[i], ".png", 3, 0.6f);
        put_image(out, "renders/T_F", names[i], ".png", 3, 0.8f);
        put_image(out, "renders/R", names[i], ".png", 3, 0.5f);
        put_image(out, "renders/depth_T", names[i], ".tif", 1, 2.5f);
    }
    put_image(out, "export", "strange name#1", ".ply.png", 3, 0);
    char *odd = fs_file_path("%s/export/T_N #1%%.ply", out);
    assert_int_equal(fs_file_write(odd, "ply\n", 4, NULL), 0);
    char *dir = fs_file_path("%s/warnings", out);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    free(dir);
    put_text(out, "warnings/ingest.txt", "ingest: <b>IMG</b> & co\n");
    put_text(out, "log.jsonl",
             "{\"step\": 100, \"seconds\": 2, \"l1\": 0.3}\nnonsense\n{\"step\": 200, \"l1\": nan}\n"
             "{\"step\": 300, \"seconds\": 6.5, \"l1\": 0.1}\n");
    put_text(out, "evaluate.json", "{\"methods\": {\"flashsplat\": {\"layers\": {\"T_N\": {\"psnr_gain\": 31.25}}}}}");
    dir = fs_file_path("%s/done", out);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    free(dir);
    put_text(out, "done/train.json", "{\"settings\": {\"steps\": 777, \"geometry\": \"separate\", \"dssim\": 0}}");
    put_text(out, "done/render.json", "[rubbish");
    put_text(out, "done/evaluate.json", "{}");
    assert_int_equal(report(out, NULL), 0);
    char *text = page(out);
    assert_non_null(strstr(text, "<tr class=\"set\"><td><code>--steps</code></td><td>777</td>"));
    assert_non_null(strstr(text, "<tr class=\"set\"><td><code>--geometry</code></td><td>separate</td>"));
    assert_non_null(strstr(text, "<tr><td><code>--dssim</code></td><td>0</td>"));
    assert_non_null(strstr(text, "&lt;script&gt;*")); // of --flash-glob, which no stage ran with
    assert_non_null(strstr(text, "a&lt;b&gt;&amp;&quot;c"));
    assert_non_null(strstr(text, "&lt;b&gt;IMG&lt;/b&gt; &amp; co"));
    assert_null(strstr(text, "a<b>"));
    assert_null(strstr(text, "<script>*"));
    assert_null(strstr(text, "http")); // nothing from the network
    assert_non_null(strstr(text, "T_N%20%231%25.ply"));
    assert_non_null(strstr(text, "31.25"));
    assert_non_null(strstr(text, "<b>300</b> training steps in <b>6</b> seconds"));
    assert_non_null(strstr(text, "class=\"compare\""));
    assert_int_equal(check_links(out, text, "src=\""), 4 + 4 * 5); // buttons; photo, T_N, T_F, R, depth (no composite)
    assert_true(check_links(out, text, "href=\"") >= 4 * 5 + 2);
    char *picture = fs_file_path("%s/report/1_T_F.jpg", out);
    Image image = {0};
    assert_int_equal(fs_jpeg_read(picture, &image, NULL), 0);
    assert_int_equal(image.width, WIDTH);
    fs_image_free(&image);
    free(picture);
    free(odd);
    free(text);
}

static void it_makes_do_with_little(void **state)
{
    const char *out = *state;
    FsError err = {0};
    assert_true(report(out, &err) < 0); // no posed photos at all
    assert_non_null(strstr(err.message, "views.json"));
    put_views(out);
    put_image(out, "renders/T_N", names[1], ".png", 3, 0.6f);
    put_image(out, "renders/R", names[1], ".png", 3, 0.6f);
    char *broken = fs_file_path("%s/renders/R/%s.png", out, names[1]);
    assert_int_equal(fs_file_write(broken, "\x89PNG\r\n\x1a\nrubbish", 15, NULL), 0);
    put_text(out, "evaluate.json", "{\"methods\": [1, 2]}");
    assert_int_equal(fs_file_mkdirs(fs_file_at("%s/done", out).text, NULL), 0);
    put_text(out, "done/evaluate.json", "{}");
    put_text(out, "log.jsonl", "");
    assert_int_equal(report(out, &err), 0); // a picture that cannot be read is left out
    char *text = page(out);
    assert_null(strstr(text, "class=\"compare\""));
    assert_int_equal(check_links(out, text, "src=\""), 1);
    char *index = fs_file_path("%s/index.html", out);
    assert_int_equal(remove(index), 0);
    assert_int_equal(fs_file_mkdirs(index, NULL), 0); // in the way
    assert_int_equal(report(out, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "index.html"));
    free(index);
    free(broken);
    free(text);
}

// By the mark of their stage: copies have other times.
static void figures_of_other_renders_are_left_out(void **state)
{
    const char *out = *state;
    FilePath done = fs_file_at("%s/done", out), mark = fs_file_at("%s/evaluate.json", done.text);
    assert_int_equal(fs_owned_open(out, "project", NULL), 0);
    put_views(out);
    assert_int_equal(fs_file_mkdirs(done.text, NULL), 0);
    put_text(out, "done/evaluate.json", "{}");
    put_text(out, "evaluate.json", "{\"methods\": {\"flashsplat\": {\"layers\": {\"T_N\": {\"psnr_gain\": 31.25}}}}}");
    for (int old = 0; old < 2; old++) {
        if (old) fs_owned_remove(mark.text);
        assert_int_equal(report(out, NULL), 0);
        char *text = page(out);
        assert_int_equal(strstr(text, "Against the truth") != NULL, !old);
        assert_int_equal(strstr(text, "31.25") != NULL, !old);
        free(text);
    }
}

// By its step: names of more than five digits come before others.
static void the_newest_progress_picture_is_shown(void **state)
{
    const char *out = *state;
    FsSettings *settings = fs_settings_new();
    FsProject *project;
    ReportLive *live;
    put_image(out, "progress", "100000", ".png", 3, 0.5f);
    put_image(out, "progress", "99500", ".png", 3, 0.5f);
    const FsCallbacks callbacks = {.log = said_keep};
    fs_info_results(out, &callbacks);
    assert_non_null(strstr(said, "progress/100000.png"));
    assert_int_equal(fs_project_open(&project, out, settings, NULL, NULL), 0);
    assert_int_equal(fs_owned_open(out, "project", NULL), 0);
    project->planned = FS_STAGE_TRAIN;
    assert_int_equal(fs_report_live_begin(&live, project, NULL), 0);
    fs_log_progress(&project->log, "train", 1, 2, "");
    fs_report_live_end(live, NULL);
    char *text = page(out);
    assert_non_null(strstr(text, "src=\"progress/100000.png\""));
    free(text);
    fs_project_close(project);
    fs_settings_free(settings);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(the_page_shows_what_is_there, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(figures_of_other_renders_are_left_out, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(the_newest_progress_picture_is_shown, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(it_makes_do_with_little, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

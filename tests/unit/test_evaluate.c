// Evaluation of a small fixture against figures that an independent program computed, and its errors.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "evaluate/evaluate.h"
#include "evaluate/metrics.h"
#include "evaluate/truth.h"
#include "image/tone.h"
#include "said.h"
#include "temp_dir.h"

#ifndef FIXTURE
#error "FIXTURE must name tests/data/evaluate"
#endif

// Runs on a fresh OUT with name/value settings; the JSON, or NULL and the error.
static json_t *evaluate(const char *dir, const char *truth, const char *const *settings, FsError *err)
{
    FsSettings *set = fs_settings_new();
    for (int i = 0; settings[i]; i += 2) assert_int_equal(fs_settings_set(set, settings[i], settings[i + 1], err), 0);
    said_forget();
    struct FsProject project = {.out = fs_file_path("%s/out", dir), .set = *set, .log = {.log = said_keep}};
    assert_int_equal(fs_file_mkdirs(project.out, NULL), 0);
    char *path = fs_file_path("%s/evaluate.json", project.out);
    int rc = fs_evaluate_run(&project, truth, err);
    json_t *root = rc == 0 ? json_load_file(path, 0, NULL) : NULL;
    assert_int_equal(root == NULL, rc < 0);
    if (rc < 0) assert_int_equal(rc, err->code);
    free(path);
    free(project.out);
    free(project.fingerprint);
    fs_settings_free(set);
    return root;
}

static double number(const json_t *object, const char *name)
{
    json_t *value = json_object_get(object, name);
    if (!json_is_number(value)) fail_msg("no number %s", name);
    return json_number_value(value);
}

static void assert_near(const char *what, double expected, double found, double tolerance)
{
    if (!(fabs(expected - found) <= tolerance)) fail_msg("%s: expected %.9g, found %.9g", what, expected, found);
}

static json_t *layers_of(json_t *root, const char *method)
{
    return json_object_get(json_object_get(json_object_get(root, "methods"), method), "layers");
}

static json_t *load(const char *name)
{
    char *path = fs_file_path("%s/%s", FIXTURE, name);
    json_t *root = json_load_file(path, 0, NULL);
    assert_non_null(root);
    free(path);
    return root;
}

static void test_agrees(void **state)
{
    static const char *const which[] = {"held_out", "capture", "all"};
    for (int k = 0; k < 3; k++) {
        FsError err;
        char name[64];
        snprintf(name, sizeof name, "expected_%s.json", which[k]);
        json_t *expected = load(name);
        json_t *root = evaluate(*state, FIXTURE "/truth",
                                (const char *[]){"views", which[k], "output", FIXTURE "/renders", NULL}, &err);
        const char *layer;
        json_t *wanted;
        json_object_foreach(expected, layer, wanted)
        {
            json_t *found = json_object_get(layers_of(root, "flashsplat"), layer);
            assert_near(layer, number(wanted, "n"), number(found, "n"), 0);
            assert_near(layer, number(wanted, "psnr"), number(found, "psnr"), 1e-3);
            assert_near(layer, number(wanted, "psnr_gain"), number(found, "psnr_gain"), 1e-3);
            assert_near(layer, number(wanted, "ssim"), number(found, "ssim"), 1e-5);
            assert_near(layer, number(wanted, "ssim_gain"), number(found, "ssim_gain"), 1e-5);
            for (size_t c = 0; c < 3; c++)
                assert_near(layer, json_number_value(json_array_get(json_object_get(wanted, "gain"), c)),
                            json_number_value(json_array_get(json_object_get(found, "gain"), c)), 6e-4);
        }
        assert_int_equal(json_object_size(expected), k == 1 ? 3 : 5);
        assert_true(!strstr(said, "W evaluate: 1 of 2 views are missing, the first one") == (k == 1));
        assert_true(!strstr(said, "no I_N at capture views") == (k != 1));
        json_decref(root);
        json_decref(expected);
    }
}

static void test_more_metrics(void **state)
{
    FsError err;
    json_t *expected = load("expected_extra.json"), *wanted;
    json_t *root =
        evaluate(*state, FIXTURE "/truth",
                 (const char *[]){"output", FIXTURE "/renders", "method", "same=" FIXTURE "/truth", NULL}, &err);
    json_t *views = json_object_get(json_object_get(layers_of(root, "flashsplat"), "T_N"), "views");
    const char *name;
    json_object_foreach(json_object_get(expected, "T_N"), name, wanted)
    {
        json_t *found = json_object_get(views, name);
        assert_near(name, number(wanted, "ms_ssim"), number(found, "ms_ssim"), 1e-6);
        assert_near(name, number(wanted, "psnr_paper"), number(found, "psnr_paper"), 1e-3);
    }
    json_t *method = json_object_get(json_object_get(root, "methods"), "flashsplat");
    json_object_foreach(json_object_get(expected, "depth_T"), name, wanted)
        assert_near(name, json_number_value(wanted), number(json_object_get(method, "depth_T"), name), 1e-5);
    // The truth as a method: perfect, and beside the other in one line.
    json_t *perfect = json_object_get(layers_of(root, "same"), "R");
    assert_near("psnr of the truth", 120, number(perfect, "psnr"), 1e-9);
    assert_near("ssim of the truth", 1, number(perfect, "ssim"), 1e-12);
    assert_near("ms_ssim of the truth", 1, number(perfect, "ms_ssim"), 1e-12);
    assert_non_null(strstr(said, "layer | flashsplat     | same"));
    json_decref(root);
    json_decref(expected);
}

// The truth's T_N as another program would write it, under <dir>/T_N.
static void write_as_others(const char *dir, Encoding encoding, const char *ending, int narrower)
{
    Image image, small;
    FilePath from = fs_file_at("%s", FIXTURE "/truth/T_N"), to = fs_file_at("%s/T_N", dir);
    FileList list;
    assert_int_equal(fs_file_list(from.text, &list, NULL) | fs_file_mkdirs(to.text, NULL), 0);
    for (int i = 0; i < list.n; i++) {
        char *stem = fs_file_stem(list.name[i]);
        FilePath path = fs_file_at("%s/%s%s", to.text, stem, ending);
        assert_int_equal(fs_png_read(fs_file_at("%s/%s", from.text, list.name[i]).text, &image, NULL), 0);
        fs_tone_decode_image(&image);
        assert_int_equal(fs_image_resize_area(&image, image.width - narrower, image.height, &small, NULL), 0);
        for (size_t k = 0; k < fs_image_values(&small); k++)
            if (encoding == ENCODING_SRGB) small.px[k] = fs_tone_srgb_encode(small.px[k]);
        bool tiff = strstr(ending, ".tif") != NULL;
        FsError err;
        int rc = tiff ? fs_tiff_write_float(path.text, &small, &err) : fs_png_write(path.text, &small, 16, &err);
        if (rc < 0) fail_msg("%s", err.message);
        fs_image_free(&image);
        fs_image_free(&small);
        free(stem);
    }
    fs_file_list_free(&list);
}

static double others_psnr(const char *dir, const char *folder, const char *encoding, double *n)
{
    FsError err;
    FilePath method = fs_file_at("x=%s", folder);
    json_t *root = evaluate(
        dir, FIXTURE "/truth",
        (const char *[]){"output", FIXTURE "/renders", "method", method.text, "method-encoding", encoding, NULL}, &err);
    if (!root) fail_msg("%s", err.message);
    json_t *layer = json_object_get(layers_of(root, "x"), "T_N");
    double psnr = *n > 0 ? number(layer, "psnr") : 0;
    *n = number(layer, "n");
    json_decref(root);
    return psnr;
}

static void test_other_programs(void **state)
{
    double n = 1;
    FilePath srgb = fs_file_at("%s/srgb", (char *)*state), linear = fs_file_at("%s/linear", (char *)*state);
    FilePath rounded = fs_file_at("%s/rounded", (char *)*state);
    write_as_others(srgb.text, ENCODING_SRGB, "_DSRNet_l.PNG", 0);
    assert_true(others_psnr(*state, srgb.text, "srgb", &n) > 60);
    assert_true(n >= 1);
    assert_true(others_psnr(*state, srgb.text, "gamma", &n) < 40);
    write_as_others(linear.text, ENCODING_LINEAR, ".tif", 0);
    assert_true(others_psnr(*state, linear.text, "linear", &n) > 100);
    write_as_others(rounded.text, ENCODING_LINEAR, "-t.tif", 1); // sides that are multiples of something
    assert_true(others_psnr(*state, rounded.text, "linear", &n) > 30);
}

// A file of others is that of the longest name that it begins with.
static void test_names_that_begin_alike(void **state)
{
    static const char *const names[] = {"IMG_1", "IMG_1_flash", "IMG_2"};
    static const struct {
        const char *file, *of;
    } cases[] = {{"IMG_1_flash.png", "IMG_1_flash"},
                 {"IMG_1_flash_out.JPEG", "IMG_1_flash"},
                 {"IMG_1_out.tif", "IMG_1"},
                 {"IMG_2_flash.png", "IMG_2"},
                 {"IMG_11.png", NULL}};
    Dataset cameras = {0};
    FilePath dir = fs_file_at("%s/alike/T_N", (char *)*state), path;
    for (int i = 0; i < 3; i++)
        assert_int_equal(fs_dataset_append(&cameras, &(View){.name = (char *)names[i]}, NULL), 0);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        fs_file_remove_tree(dir.text);
        assert_int_equal(fs_file_mkdirs(dir.text, NULL), 0);
        assert_int_equal(fs_file_write(fs_file_at("%s/%s", dir.text, cases[i].file).text, "x", 1, NULL), 0);
        for (int k = 0; k < 3; k++) {
            FilePath top = fs_file_at("%s/alike", (char *)*state);
            int found = fs_truth_find_estimate(top.text, "T_N", &cameras, names[k], &path);
            if (found != (cases[i].of && strcmp(cases[i].of, names[k]) == 0))
                fail_msg("%s for %s", cases[i].file, names[k]);
        }
    }
    fs_dataset_free(&cameras);
}

static void copy_file(const char *from, const char *to)
{
    char *data;
    size_t size;
    assert_int_equal(fs_file_read(from, 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(fs_file_write(to, data, size, NULL), 0);
    free(data);
}

// Pictures of one layer of the fixture as those of another in `to`.
static void copy_layer(const char *layer, const char *to, const char *as)
{
    FileList list = {0};
    FilePath from = fs_file_at("%s/%s", FIXTURE "/truth", layer), dir = fs_file_at("%s/%s", to, as);
    assert_int_equal(fs_file_mkdirs(dir.text, NULL), 0);
    assert_int_equal(fs_file_list(from.text, &list, NULL), 0);
    for (int i = 0; i < list.n; i++)
        copy_file(fs_file_at("%s/%s", from.text, list.name[i]).text, fs_file_at("%s/%s", dir.text, list.name[i]).text);
    fs_file_list_free(&list);
}

// Where the truth has no composites, the paired difference is that of T_F and T_N.
static void test_paired_difference_of_T(void **state)
{
    FsError err;
    FilePath truth = fs_file_at("%s/of_T", (char *)*state);
    copy_layer("I_N", truth.text, "T_N");
    copy_layer("I_F", truth.text, "T_F");
    copy_file(FIXTURE "/truth/cameras.json", fs_file_at("%s/cameras.json", truth.text).text);
    const char *const renders[] = {"output", FIXTURE "/renders", NULL};
    json_t *of_I = evaluate(*state, FIXTURE "/truth", renders, &err);
    json_t *of_T = evaluate(*state, truth.text, renders, &err);
    assert_near("psnr_paper", number(json_object_get(layers_of(of_I, "flashsplat"), "T_N"), "psnr_paper"),
                number(json_object_get(layers_of(of_T, "flashsplat"), "T_N"), "psnr_paper"), 1e-9);
    json_decref(of_I);
    json_decref(of_T);
}

// Two pictures that may be meant are no missing one.
static void test_two_that_may_be_meant(void **state)
{
    FsError err;
    FilePath others = fs_file_at("%s/two", (char *)*state);
    FileList list = {0};
    copy_layer("T_N", others.text, "T_N");
    assert_int_equal(fs_file_list(fs_file_at("%s/T_N", others.text).text, &list, NULL), 0);
    for (int i = 0; i < list.n; i++) {
        FilePath path = fs_file_at("%s/T_N/%s", others.text, list.name[i]);
        char *stem = fs_file_stem(path.text);
        copy_file(path.text, fs_file_at("%s/T_N/%s_l.png", others.text, stem).text);
        copy_file(path.text, fs_file_at("%s/T_N/%s_r.png", others.text, stem).text);
        fs_file_remove_tree(path.text);
        free(stem);
    }
    fs_file_list_free(&list);
    FilePath method = fs_file_at("two=%s", others.text);
    assert_null(evaluate(*state, FIXTURE "/truth",
                         (const char *[]){"output", FIXTURE "/renders", "method", method.text, NULL}, &err));
    assert_non_null(strstr(err.message, "2 pictures may be of"));
}

// Of either scene: a float TIFF in world units against the truth's millimetres.
static void check_depth(void **state, const char *layer)
{
    char *at = *state;
    FilePath truth = fs_file_at("%s/%s truth", at, layer), renders = fs_file_at("%s/%s renders", at, layer);
    FilePath folder[] = {fs_file_at("%s/T_N", truth.text), fs_file_at("%s/%s", truth.text, layer),
                         fs_file_at("%s/T_N", renders.text), fs_file_at("%s/%s", renders.text, layer)};
    for (int i = 0; i < 4; i++) assert_int_equal(fs_file_mkdirs(folder[i].text, NULL), 0);
    copy_file(FIXTURE "/truth/cameras.json", fs_file_at("%s/cameras.json", truth.text).text);
    copy_file(FIXTURE "/truth/T_N/TEST_01.png", fs_file_at("%s/TEST_01.png", folder[0].text).text);
    copy_file(FIXTURE "/truth/depth_T/TEST_01.png", fs_file_at("%s/TEST_01.png", folder[1].text).text);
    copy_file(FIXTURE "/truth/depth_T/TEST_02.png", fs_file_at("%s/TEST_02.png", folder[1].text).text);
    copy_file(FIXTURE "/renders/T_N/TEST_01.png", fs_file_at("%s/TEST_01.png", folder[2].text).text);
    Image depth;
    assert_int_equal(fs_png_read(FIXTURE "/truth/depth_T/TEST_01.png", &depth, NULL), 0);
    for (int i = 0; i < depth.width * depth.height; i++) depth.px[i] *= 65.535f * 4; // a unit of 25 cm
    depth.px[100] = NAN;
    assert_int_equal(fs_tiff_write_float(fs_file_at("%s/TEST_01.tif", folder[3].text).text, &depth, NULL), 0);
    FsError err;
    json_t *root = evaluate(at, truth.text, (const char *[]){"output", renders.text, NULL}, &err);
    json_t *method = json_object_get(json_object_get(root, "methods"), "flashsplat");
    json_t *found = json_object_get(method, layer);
    assert_near("error", 3, number(found, "median_relative_error"), 1e-5);
    assert_near("scale", 0.25, number(found, "scale"), 1e-6);
    assert_near("scaled error", 0, number(found, "median_relative_error_scaled"), 1e-5);
    assert_near("missing", 1, number(found, "missing"), 0);
    assert_null(json_object_get(method, strcmp(layer, "depth_T") ? "depth_T" : "depth_R")); // the truth has none
    json_decref(root);
    fs_image_free(&depth);
}

static void test_depths(void **state)
{
    check_depth(state, "depth_T");
    check_depth(state, "depth_R");
}

static void test_threads(void **state)
{
    char *text[2];
    for (int k = 0; k < 2; k++) {
        FsError err;
        json_t *root = evaluate(*state, FIXTURE "/truth",
                                (const char *[]){"output", FIXTURE "/renders", "threads", k ? "3" : "1", NULL}, &err);
        text[k] = json_dumps(root, JSON_SORT_KEYS);
        json_decref(root);
    }
    assert_string_equal(text[0], text[1]);
    free(text[0]);
    free(text[1]);
}

static void expect_error(const char *dir, const char *truth, const char *const *settings, int code, const char *word)
{
    FsError err = {0};
    json_t *root = evaluate(dir, truth, settings, &err);
    assert_null(root);
    assert_int_equal(err.code, code);
    if (!strstr(err.message, word)) fail_msg("'%s' lacks '%s'", err.message, word);
}

static void test_errors(void **state)
{
    const char *dir = *state, *renders = FIXTURE "/renders", *truth = FIXTURE "/truth";
    expect_error(dir, dir, (const char *[]){"output", renders, NULL}, FS_ERR_INPUT, "cameras.json");
    expect_error(dir, truth, (const char *[]){NULL}, FS_ERR_INPUT, "out/renders");
    expect_error(dir, truth, (const char *[]){"output", dir, NULL}, FS_ERR_INPUT, "has a render");
    expect_error(dir, truth, (const char *[]){"output", renders, "method", "x", NULL}, FS_ERR_USAGE, "NAME=DIR");
    expect_error(dir, truth, (const char *[]){"output", renders, "method", "x=", NULL}, FS_ERR_USAGE, "NAME=DIR");
    expect_error(dir, truth, (const char *[]){"output", renders, "method", "=x", NULL}, FS_ERR_USAGE, "NAME=DIR");
    expect_error(dir, truth, (const char *[]){"output", renders, "method", "x=/nonexistent", NULL}, FS_ERR_INPUT,
                 "/nonexistent");
    expect_error(dir, truth, (const char *[]){"output", renders, "method", "flashsplat=" FIXTURE, NULL}, FS_ERR_USAGE,
                 "twice");
    // A render that is no PNG, and one of other proportions.
    char *bad = fs_file_path("%s/bad", dir), *t_n = fs_file_path("%s/T_N", bad),
         *png = fs_file_path("%s/TEST_01.png", t_n);
    assert_int_equal(fs_file_mkdirs(t_n, NULL), 0);
    assert_int_equal(fs_file_write(png, "not a picture", 13, NULL), 0);
    expect_error(dir, truth, (const char *[]){"output", bad, NULL}, FS_ERR_INPUT, png);
    Image image;
    assert_int_equal(fs_image_new(&image, 64, 60, 3, NULL), 0);
    assert_int_equal(fs_png_write(png, &image, 8, NULL), 0);
    expect_error(dir, truth, (const char *[]){"output", bad, NULL}, FS_ERR_INPUT, "proportions");
    fs_image_free(&image);
    free(bad), free(t_n), free(png);
}

// Of another program: what cannot be measured is refused, and what is measured otherwise is told.
static void test_pictures_of_others(void **state)
{
    FsError err;
    Image image, half;
    FilePath others = fs_file_at("%s/others", (char *)*state), method = fs_file_at("x=%s", others.text);
    FilePath layer = fs_file_at("%s/T_N", others.text), eyes = fs_file_at("%s/depth_T", others.text);
    const char *const settings[] = {"output", FIXTURE "/renders", "method", method.text, NULL};
    assert_int_equal(fs_file_mkdirs(eyes.text, NULL), 0);
    expect_error(*state, FIXTURE "/truth", settings, FS_ERR_INPUT, "others: no picture of a view");
    copy_layer("T_N", others.text, "T_N");
    assert_int_equal(fs_png_read(FIXTURE "/renders/T_N/TEST_01.png", &image, NULL), 0);
    assert_int_equal(fs_png_write(fs_file_at("%s/TEST_01.png", eyes.text).text, &image, 8, NULL), 0);
    json_decref(evaluate(*state, FIXTURE "/truth", settings, &err));
    assert_non_null(strstr(said, "W evaluate: 1 pictures in"));
    assert_null(strstr(said, "may score higher"));

    assert_int_equal(fs_image_resize_area(&image, image.width / 2, image.height / 2, &half, NULL), 0);
    assert_int_equal(fs_png_write(fs_file_at("%s/TEST_01.png", layer.text).text, &half, 8, NULL), 0);
    json_t *root = evaluate(*state, FIXTURE "/truth", settings, &err);
    assert_near("width", half.width, number(json_object_get(layers_of(root, "x"), "T_N"), "width"), 0);
    assert_non_null(strstr(said, "may score higher"));
    json_decref(root);

    assert_int_equal(fs_png_write(fs_file_at("%s/TEST_01.PNG", layer.text).text, &half, 8, NULL), 0);
    expect_error(*state, FIXTURE "/truth", settings, FS_ERR_INPUT, "2 pictures may be of");
    assert_int_equal(remove(fs_file_at("%s/TEST_01.PNG", layer.text).text), 0);
    assert_int_equal(remove(fs_file_at("%s/TEST_01.png", layer.text).text), 0);
    for (int i = 0; i < 2; i++) {
        image.px[77] = i ? INFINITY : NAN;
        assert_int_equal(fs_tiff_write_float(fs_file_at("%s/TEST_01.tif", layer.text).text, &image, NULL), 0);
        expect_error(*state, FIXTURE "/truth", settings, FS_ERR_INPUT, "TEST_01.tif: some of its values");
    }
    fs_image_free(&image);
    fs_image_free(&half);
}

// Truncated renders at every length: always an error that names the file.
static void test_truncated(void **state)
{
    char *bad = fs_file_path("%s/cut", (char *)*state), *t_n = fs_file_path("%s/T_N", bad);
    char *png = fs_file_path("%s/TEST_01.png", t_n), *data;
    size_t size;
    assert_int_equal(fs_file_mkdirs(t_n, NULL), 0);
    assert_int_equal(fs_file_read(FIXTURE "/renders/T_N/TEST_01.png", 1 << 20, &data, &size, NULL), 0);
    for (size_t n = 0; n + 12 < size; n += 97) { // but for the end marker
        FILE *f = fopen(png, "wb");
        fwrite(data, 1, n, f);
        fclose(f);
        expect_error(*state, FIXTURE "/truth", (const char *[]){"output", bad, NULL}, FS_ERR_INPUT, png);
    }
    free(data), free(bad), free(t_n), free(png);
}

static void test_scales(void **state)
{
    (void)state;
    assert_int_equal(fs_metrics_ms_ssim_scales(600, 400), 5);
    assert_int_equal(fs_metrics_ms_ssim_scales(176, 300), 5);
    assert_int_equal(fs_metrics_ms_ssim_scales(175, 300), 4);
    assert_int_equal(fs_metrics_ms_ssim_scales(11, 11), 1);
    assert_int_equal(fs_metrics_ms_ssim_scales(10, 500), 0);
    Image a, b;
    double value;
    const MetricContext none = {0};
    assert_int_equal(fs_image_new(&a, 10, 3, 3, NULL) | fs_image_new(&b, 10, 3, 3, NULL), 0);
    a.px[0] = 1;
    assert_int_equal(fs_metrics_ms_ssim(&a, &b, &none, &value, NULL), 0);
    assert_true(isnan(value));
    assert_int_equal(fs_metrics_ssim(&a, &b, &none, &value, NULL), 0);
    assert_true(value > 0 && value < 1);
    assert_int_equal(fs_metrics_psnr(&a, &b, &none, &value, NULL), 0);
    assert_near("psnr", 10 * log10(90), value, 1e-12);
    fs_image_free(&a);
    fs_image_free(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agrees),
        cmocka_unit_test(test_more_metrics),
        cmocka_unit_test(test_depths),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_errors),
        cmocka_unit_test(test_pictures_of_others),
        cmocka_unit_test(test_truncated),
        cmocka_unit_test(test_scales),
        cmocka_unit_test(test_paired_difference_of_T),
        cmocka_unit_test(test_two_that_may_be_meant),
        cmocka_unit_test(test_names_that_begin_alike),
        cmocka_unit_test(test_other_programs),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}

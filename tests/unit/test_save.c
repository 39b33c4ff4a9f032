// Encodings of rendered layers on disk, as other programs read them.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/owned.h"
#include <string.h>

#include "base/optics.h"
#include "model/scene.h"
#include "render/save.h"
#include "temp_dir.h"

static Image ramp(int channels)
{
    static const float values[] = {0, 1e-6f, 0.001f, 0.01f, 0.18f, 0.5f, 0.999f, 1, 1.7f, -0.01f};
    Image image;
    assert_int_equal(fs_image_new(&image, 10, 1, channels, NULL), 0);
    for (int i = 0; i < 10 * channels; i++) image.px[i] = values[i % 10];
    return image;
}

static Image saved(const char *dir, RenderLayer layer, const Image *image, double metres_per_unit, bool linear,
                   const char *ext)
{
    Image back = {0};
    assert_int_equal(fs_save_prepare(dir, layer, NULL), 0);
    assert_int_equal(fs_save_layer(dir, layer, "view 1", image, (SaveScale){metres_per_unit, 1}, linear, NULL), 0);
    char *path = fs_file_path("%s/%s/view 1.%s", dir, fs_render_layers[layer].name, ext);
    int rc = strcmp(ext, "png") == 0 ? fs_png_read(path, &back, NULL) : fs_tiff_read(path, &back, NULL);
    assert_int_equal(rc, 0);
    free(path);
    return back;
}

static bool exists(const char *dir, const char *name)
{
    char *path = fs_file_path("%s/%s", dir, name);
    bool there = fs_file_exists(path);
    free(path);
    return there;
}

// Where a response pressed highlights together, what it brings to the photos' white is 255: nothing is clipped.
static void highlights_are_kept(void **state)
{
    double response[FS_OPTICS_KNOTS] = {0};
    Image image = ramp(3), back = {0};
    assert_float_equal(fs_scene_white(response), 1, 1e-6);
    response[9] = 0.1; // h(1) = 1 still
    assert_float_equal(fs_scene_white(response), 1, 1e-6);
    response[8] = -0.05, response[9] = -0.1, response[10] = -0.15; // h(1.125) = 1.025, h(1) = 0.95
    float white = fs_scene_white(response);
    assert_float_equal(pow((double)white, 0.22), 1 + 0.125 * 0.05 / 0.075, 1e-5);
    response[9] = -0.15, response[10] = -0.26; // h(1.25) = 0.99, and on
    assert_float_equal(pow((double)fs_scene_white(response), 0.22), 1.26, 1e-5);
    assert_int_equal(fs_save_prepare(*state, RENDER_T_F, NULL), 0);
    assert_int_equal(fs_save_layer(*state, RENDER_T_F, "white", &image, (SaveScale){0, white}, true, NULL), 0);
    char *path = fs_file_path("%s/T_F/white.png", (char *)*state);
    assert_int_equal(fs_png_read(path, &back, NULL), 0);
    for (int i = 0; i < 30; i++) {
        double value = pow(fmin(fmax((double)image.px[i] / (double)white, 0), 1), 0.22);
        assert_float_equal(back.px[i] * 255, floor(value * 255 + 0.5), 1e-3);
    }
    fs_image_free(&back);
    path[strlen(path) - 3] = 't', path[strlen(path) - 2] = 'i', path[strlen(path) - 1] = 'f';
    assert_int_equal(fs_tiff_read(path, &back, NULL), 0);
    assert_memory_equal(back.px, image.px, 30 * sizeof(float)); // light as it is
    fs_image_free(&back);
    fs_image_free(&image);
    free(path);
}

static void colours_are_gamma_encoded_8_bit(void **state)
{
    Image image = ramp(3), back = saved(*state, RENDER_T_N, &image, 0, false, "png");
    assert_int_equal(back.channels, 3);
    for (int i = 0; i < 30; i++) {
        double linear = fmin(fmax(image.px[i], 0), 1);
        assert_float_equal(back.px[i] * 255, floor(pow(linear, 0.22) * 255 + 0.5), 1e-3);
    }
    assert_false(exists(*state, "T_N/view 1.tif"));
    fs_image_free(&back);
    back = saved(*state, RENDER_R, &image, 0, true, "tif"); // linear, as it is: nothing clipped
    assert_true(exists(*state, "R/view 1.png"));
    assert_memory_equal(back.px, image.px, 30 * sizeof(float));
    fs_image_free(&back);
    fs_image_free(&image);
}

static void reflectance_is_linear_16_bit(void **state)
{
    Image image = ramp(1), back = saved(*state, RENDER_BETA, &image, 0, false, "png");
    assert_int_equal(back.channels, 1);
    for (int i = 0; i < 10; i++)
        assert_float_equal(back.px[i] * 65535, floor(fmin(fmax(image.px[i], 0), 1) * 65535.0 + 0.5), 0.01);
    fs_image_free(&back);
    fs_image_free(&image);
}

static void depth_is_millimetres_where_the_scale_is_known(void **state)
{
    Image image;
    assert_int_equal(fs_image_new(&image, 5, 1, 1, NULL), 0);
    const float units[5] = {0, 1.2344f, 3.00026f, 40000, NAN};
    const double mm[5] = {0, 2469, 6001, 0, 0}; // 2 metres a unit; beyond 65.5 m there is no value
    memcpy(image.px, units, sizeof units);
    assert_int_equal(fs_owned_open(*state, "renders", NULL), 0);
    Image back = saved(*state, RENDER_DEPTH_T, &image, 2, false, "png");
    for (int i = 0; i < 5; i++) assert_float_equal(back.px[i] * 65535, mm[i], 0.01);
    assert_false(exists(*state, "depth_T/view 1.tif"));
    fs_image_free(&back);
    back = saved(*state, RENDER_DEPTH_R, &image, 2, false, "png");
    assert_true(exists(*state, "depth_R/view 1.png"));
    fs_image_free(&back);
    back = saved(*state, RENDER_DEPTH_R, &image, 0, false, "tif"); // the other file goes
    assert_memory_equal(back.px, image.px, 4 * sizeof(float));
    assert_false(exists(*state, "depth_R/view 1.png"));
    fs_image_free(&back);
    fs_image_free(&image);
}

static void unwritable_folders_are_named(void **state)
{
    FsError err = {0};
    Image image = ramp(3);
    char *file = fs_file_path("%s/a file", (const char *)*state);
    assert_int_equal(fs_file_write(file, "x", 1, NULL), 0);
    assert_int_equal(fs_save_prepare(file, RENDER_T_F, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, file));
    assert_int_equal(fs_save_layer(file, RENDER_T_F, "v", &image, (SaveScale){0, 1}, true, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, file));
    free(file);
    fs_image_free(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(highlights_are_kept, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(colours_are_gamma_encoded_8_bit, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(reflectance_is_linear_16_bit, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(depth_is_millimetres_where_the_scale_is_known, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(unwritable_folders_are_named, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

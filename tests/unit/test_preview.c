// Pictures for people: the choice of views, the exposure, and the colours of depth.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "image/colormap.h"
#include "image/tone.h"
#include "model/preview.h"
#include "temp_dir.h"

static void views_alternate_between_flash_and_not(void **state)
{
    (void)state;
    View view[10] = {0};
    for (int i = 0; i < 10; i++) view[i].flash = i % 2 == 0;
    Dataset data = {view, 10};
    int chosen[12];
    assert_int_equal(fs_preview_choose(&data, 4, chosen), 4);
    for (int i = 0; i < 4; i++) assert_int_equal(view[chosen[i]].flash, i % 2);
    assert_true(chosen[2] > chosen[0] + 2 && chosen[3] > chosen[1] + 2);
    assert_int_equal(fs_preview_choose(&data, 12, chosen), 10); // each once
    for (int i = 0; i < 10; i++) view[i].flash = false;
    assert_int_equal(fs_preview_choose(&data, 4, chosen), 2);
    data.n = 0;
    assert_int_equal(fs_preview_choose(&data, 4, chosen), 0);
}

static void put_photo(const char *out, const View *view, float value)
{
    Image photo, mask;
    assert_int_equal(fs_image_new(&photo, view->camera.width, view->camera.height, 3, NULL), 0);
    assert_int_equal(fs_image_new(&mask, view->camera.width, view->camera.height, 1, NULL), 0);
    for (int i = 0; i < photo.width * photo.height * 3; i++) photo.px[i] = value;
    char *path = fs_file_path("%s/images/%s.tif", out, view->name);
    assert_int_equal(fs_tiff_write_float(path, &photo, NULL), 0);
    free(path);
    path = fs_file_path("%s/images/%s_mask.png", out, view->name);
    assert_int_equal(fs_png_write(path, &mask, 8, NULL), 0);
    free(path);
    fs_image_free(&photo);
    fs_image_free(&mask);
}

static void one_exposure_suits_all_photos(void **state)
{
    View view[2] = {{.name = "a", .camera = {.width = 40, .height = 20}},
                    {.name = "b", .flash = true, .camera = {.width = 40, .height = 20}}};
    Dataset data = {view, 2};
    FsError err = {0};
    PreviewLight light = {0};
    assert_true(fs_preview_light(*state, &data, &light, &err) < 0); // no photos yet
    char *images = fs_file_path("%s/images", (const char *)*state);
    assert_int_equal(fs_file_mkdirs(images, NULL), 0);
    put_photo(*state, &view[0], 0.05f);
    put_photo(*state, &view[1], 0.2f);
    assert_int_equal(fs_preview_light(*state, &data, &light, &err), 0);
    float bright = fs_tone_pleasant(0.2f, light.exposure), dark = fs_tone_pleasant(0.05f, light.exposure);
    assert_true(bright > 0.75f && bright < 0.97f && dark > 0.3f && dark < bright);
    Image linear, picture;
    assert_int_equal(fs_image_new(&linear, 40, 20, 1, NULL), 0);
    for (int i = 0; i < 800; i++) linear.px[i] = i % 2 ? 0.4f : 0;
    assert_int_equal(fs_preview_picture(&linear, 10, &light, &picture, NULL), 0); // averaged before the curve
    assert_int_equal(picture.width, 10);
    assert_int_equal(picture.height, 5);
    assert_float_equal(picture.px[12], bright, 1e-4);
    fs_image_free(&picture);
    assert_false(light.has_matrix);
    char *ingested =
        fs_file_path("%s/ingest.json", (const char *)*state); // the camera's red has half of its green in it
    const char text[] = "{\"srgb_from_camera\": [1.5, -0.5, 0, 0, 1, 0, 0, 0, 1]}";
    assert_int_equal(fs_file_write(ingested, text, sizeof text - 1, NULL), 0);
    assert_int_equal(fs_preview_light(*state, &data, &light, &err), 0);
    assert_true(light.has_matrix);
    Image color = {.width = 1, .height = 1, .channels = 3, .px = (float[]){0.2f, 0.1f, 0.05f}};
    assert_int_equal(fs_preview_picture(&color, 0, &light, &picture, NULL), 0);
    assert_float_equal(picture.px[0], fs_tone_pleasant(0.25f, light.exposure), 1e-5);
    assert_float_equal(picture.px[1], fs_tone_pleasant(0.1f, light.exposure), 1e-5);
    assert_float_equal(picture.px[2], dark, 1e-4);
    fs_image_free(&linear);
    fs_image_free(&picture);
    free(ingested);
    free(images);
}

static double lightness(const float rgb[3])
{
    double y = 0.2126 * fs_tone_srgb_decode(rgb[0]) + 0.7152 * fs_tone_srgb_decode(rgb[1]) +
               0.0722 * fs_tone_srgb_decode(rgb[2]);
    return y > 216.0 / 24389 ? 116 * cbrt(y) - 16 : y * 24389 / 27;
}

static void depth_colours_rise_evenly_in_lightness(void **state)
{
    (void)state;
    float rgb[3], last[3];
    fs_colormap_color(0, last);
    for (int i = 1; i <= 20; i++) {
        fs_colormap_color((float)i / 20, rgb);
        double step = lightness(rgb) - lightness(last);
        assert_true(step > 2 && step < 6); // 76 in 20 steps, less or more where the colour leaves sRGB
        for (int c = 0; c < 3; c++) {
            assert_true(rgb[c] >= 0 && rgb[c] <= 1);
            last[c] = rgb[c];
        }
    }
    fs_colormap_color(NAN, rgb);
    fs_colormap_color(0, last);
    assert_memory_equal(rgb, last, sizeof rgb);
}

static void depth_pictures_show_holes_and_near_bright(void **state)
{
    (void)state;
    Image depth, picture;
    assert_int_equal(fs_image_new(&depth, 4, 1, 1, NULL), 0);
    depth.px[0] = 0;
    depth.px[1] = 1;
    depth.px[2] = 2;
    depth.px[3] = 4;
    float nearest, farthest;
    assert_true(fs_colormap_range(&depth, 0, 1, &nearest, &farthest));
    assert_float_equal(nearest, 1, 0);
    assert_float_equal(farthest, 4, 0);
    assert_int_equal(fs_colormap_depth(&depth, nearest, farthest, &picture, NULL), 0);
    assert_float_equal(picture.px[0], picture.px[2], 0); // a hole is grey
    float middle[3];
    fs_colormap_color((0.5f - 0.25f) / 0.75f, middle);
    assert_memory_equal(picture.px + 6, middle, sizeof middle);
    assert_true(lightness(picture.px + 3) > lightness(picture.px + 6));
    assert_true(lightness(picture.px + 6) > lightness(picture.px + 9));
    fs_image_free(&picture);
    for (int i = 0; i < 4; i++) depth.px[i] = NAN;
    assert_false(fs_colormap_range(&depth, 0, 1, &nearest, &farthest));
    assert_int_equal(fs_colormap_depth(&depth, 0, 0, &picture, NULL), 0);
    fs_image_free(&picture);
    fs_image_free(&depth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_alternate_between_flash_and_not),
        cmocka_unit_test_setup_teardown(one_exposure_suits_all_photos, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(depth_colours_rise_evenly_in_lightness),
        cmocka_unit_test(depth_pictures_show_holes_and_near_bright),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

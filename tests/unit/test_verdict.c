// What is said about a trained scene: nothing about a sound one, and the right thing about each way to fail.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "render/verdict.h"
#include "said.h"

enum { W = 40, H = 30 };

static void fill(Image *image, float value)
{
    if (!image->px) assert_int_equal(fs_image_new(image, W, H, 3, NULL), 0);
    for (int i = 0; i < W * H * 3; i++) image->px[i] = value;
}

// T_N black in the first `black` rows, where R has all the light; photo = composite * fit.
static const char *say(float t, float r, int black, float fit, bool of_other_size)
{
    Renders renders = {0};
    Image photo = {0}, mask = {0};
    Verdict verdict = {0};
    Log log = {.log = said_keep};
    fill(&renders.layer[RENDER_T_N], t);
    fill(&renders.layer[RENDER_T_F], 2.5f * t);
    fill(&renders.layer[RENDER_R], r);
    for (int i = 0; i < black * W * 3; i++) {
        renders.layer[RENDER_T_N].px[i] = 0;
        renders.layer[RENDER_R].px[i] = r + t;
    }
    fill(&renders.layer[RENDER_I_N], t + r);
    fill(&renders.layer[RENDER_I_F], 2.5f * t + r);
    fill(&photo, fit * (2.5f * t + r));
    assert_int_equal(fs_image_new(&mask, W, H, 1, NULL), 0);
    for (int i = 0; i < W * H; i++) mask.px[i] = i >= W; // the first row is not to be trusted
    for (int i = 0; i < W * 3; i++) photo.px[i] = 50;
    if (of_other_size) photo.width = W - 1;
    for (int view = 0; view < 3; view++) fs_verdict_add(&verdict, &renders, &renders.layer[RENDER_I_F], &photo, &mask);
    said_forget();
    fs_verdict_tell(&verdict, &log);
    photo.width = W;
    fs_image_free(&photo);
    fs_image_free(&mask);
    fs_engine_renders_free(&renders);
    return warned;
}

static void test_sound(void **state)
{
    (void)state;
    assert_string_equal(say(0.06f, 0.05f, 0, 1, false), "");
    assert_string_equal(say(0.06f, 0.05f, 1, 1.05f, false), ""); // 3 % of the picture, 5 % of brightness
    said_forget();
    fs_verdict_tell(&(Verdict){0}, &(Log){.log = said_keep}); // nothing was rendered
    assert_string_equal(warned, "");
}

static void test_failed(void **state)
{
    (void)state;
    assert_non_null(strstr(say(0.06f, 0.05f, 9, 1, false), "30 % of the picture"));
    assert_non_null(strstr(say(0.06f, 0.0005f, 0, 1, false), "R is empty (0.8 %"));
    assert_non_null(strstr(say(0.001f, 0.08f, 0, 1, false), "T_N is empty (1.2 %"));
    assert_non_null(strstr(say(0.06f, 0.05f, 0, 2, false), "match the photos to"));
    assert_string_equal(say(0.06f, 0.05f, 0, 2, true), ""); // another size: not compared
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sound), cmocka_unit_test(test_failed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

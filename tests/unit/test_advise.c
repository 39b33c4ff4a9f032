// What is said about a capture's flash cue and its photos, from made-up cues.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <string.h>

#include <cmocka.h>

#include "initialise/start.h"
#include "said.h"

enum { POINTS = 400 };

// `lit` points whose contrast grows by `growth`, the rest mirrored; n_flash flash photos `apart` to the right of
// n_other without, each 5 cm from the next; the scene is 2 m away.
static const char *say(int lit, int reflected, double growth, int n_flash, int n_other, double apart)
{
    SmallView view[64] = {0};
    SmallViews views = {.view = view, .n = n_flash + n_other, .n_flash = n_flash};
    for (int i = 0; i < views.n; i++) {
        view[i].flash = i < n_flash;
        view[i].centre[0] = view[i].flash ? apart : 0;
        view[i].centre[1] = 0.05 * (i < n_flash ? i : i - n_flash);
    }
    Cue cue[POINTS];
    unsigned char kind[POINTS];
    for (int i = 0; i < POINTS; i++) {
        kind[i] = i < lit ? POINT_TRANSMITTED : i < lit + reflected ? POINT_REFLECTED : POINT_UNSURE;
        cue[i] = (Cue){.ok = true, .log_slope = i < lit ? (float)log(growth) : 0.04f, .sigma = 0.15f};
        cue[i].log_slope += 0.05f * (float)(i % 5 - 2);
    }
    FlashLight light = {.color = {1, 1, 1}, .distance = 2};
    Log log = {.log = said_keep};
    said_forget();
    fs_advise(&views, &(SparsePoints){.n = POINTS, .cue = cue, .kind = kind}, &light, &log);
    return warned;
}

static void test_sound(void **state)
{
    (void)state;
    assert_string_equal(say(250, 120, 2.0, 15, 15, 0.05), "");
    assert_string_equal(say(250, 120, 1.35, 6, 6, 0.1), ""); // weak but sound, 12 photos
}

static void test_warns(void **state)
{
    (void)state;
    say(250, 120, 1.07, 15, 15, 0.05);
    assert_non_null(strstr(warned, "weak flash: contrast behind the pane grows only 1.07 times"));
    assert_non_null(strstr(warned, "only 0.2 errors of a point"));
    assert_non_null(strstr(say(40, 200, 2.0, 15, 15, 0.05), "only 40 points are surely behind"));
    assert_non_null(strstr(say(250, 30, 2.0, 15, 15, 0.05), "only 30 points are surely mirrored"));
    assert_non_null(strstr(say(250, 120, 2.0, 3, 15, 0.05), "only 3 photos with the flash"));
    assert_non_null(strstr(say(250, 120, 2.0, 15, 2, 0.05), "only 2 photos without the flash"));
    assert_non_null(strstr(say(250, 120, 2.0, 15, 15, 0.4), "20 % of the scene's distance"));
    assert_null(strstr(warned, "weak"));
    assert_non_null(strstr(say(0, 0, 2.0, 15, 15, 0.4), "only 0 points are surely behind"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sound), cmocka_unit_test(test_warns)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// Which way is up: photos from an arc, tilted and held askew, some of them stored on their side or upside down.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/linalg.h"
#include "base/rng.h"
#include "model/vertical.h"

enum { N = 24 };

static const double truth[3] = {0.48, 0.6, 0.64}; // up, of length 1

// A camera that looks at an angle of the arc and so much down, rolled by an angle.
static Camera camera_at(double angle, double pitch, double roll)
{
    Camera c = {0};
    double east[3], north[3], level[3], right[3], ahead[3], down[3];
    const double any[3] = {1, 0, 0};
    v3_cross(any, truth, east);
    v3_normalise(east);
    v3_cross(truth, east, north);
    for (int k = 0; k < 3; k++) {
        level[k] = cos(angle) * north[k] + sin(angle) * east[k];
        right[k] = cos(angle) * east[k] - sin(angle) * north[k];
        ahead[k] = cos(pitch) * level[k] - sin(pitch) * truth[k];
    }
    v3_cross(ahead, right, down);
    for (int k = 0; k < 3; k++) {
        c.w2c[k] = cos(roll) * right[k] + sin(roll) * down[k];
        c.w2c[4 + k] = cos(roll) * down[k] - sin(roll) * right[k];
        c.w2c[8 + k] = ahead[k];
    }
    return c;
}

// Of an arc from -wide to wide; every so many photos is turned by quarters. The worst angle of the found vertical.
static double error_of(double wide, double pitch, int every, int quarters, double *lowest)
{
    static View view[N];
    const View *views[N];
    Rng rng = fs_rng_new(5);
    double up[3], lower[3];
    for (int v = 0; v < N; v++) {
        double askew = 0.06 * (fs_rng_below(&rng, 1001) / 500.0 - 1);
        double turned = every && v % every == 0 ? quarters * acos(0) : 0;
        view[v].camera = camera_at(wide * (2.0 * v / (N - 1) - 1), pitch, askew + turned);
        views[v] = &view[v];
    }
    fs_vertical_find(views, N, up);
    *lowest = -1;
    for (int v = 0; v < N; v++) {
        fs_vertical_lower(&view[v].camera, up, lower);
        *lowest = fmax(*lowest, v3_dot(lower, up));
    }
    return acos(fmin(v3_dot(up, truth), 1)) * 90 / acos(0);
}

static void test_vertical(void **state)
{
    (void)state;
    double lowest;
    for (int quarters = 0; quarters < 4; quarters++) // every third photo
        for (int bow = 1; bow < 3; bow++) {
            double off = error_of(0.4 * bow, 0.2, 3, quarters, &lowest);
            if (!(off < 4) || !(lowest < -0.9)) fail_msg("%d, %d: %g degrees, %g", quarters, bow, off, lowest);
        }
    assert_true(error_of(1.2, 1.0, 4, 1, &lowest) < 3); // around a case, steeply down
    assert_true(error_of(0, 0, 0, 0, &lowest) < 2);     // all the same way
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_vertical)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

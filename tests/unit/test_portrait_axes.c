// Which cell of a portrait a thing falls into, photo by photo: a mirror image that goes with the camera, one over a
// display case that turns with it, and what stands still each keep to one cell of their own kind alone.
#include "train/portrait_axes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/linalg.h"
#include "engine/engine.h"

enum { N = 12 };

static View view[N];
static const View *views[N];
static double centre[N][3];

// At a place, with z up, looking along a direction.
static void stand(int v, double x, double y, double z, const double look[3])
{
    Camera *c = &view[v].camera;
    const double up[3] = {0, 0, 1};
    double ahead[3] = {look[0], look[1], look[2]}, right[3], down[3];
    centre[v][0] = x, centre[v][1] = y, centre[v][2] = z;
    v3_normalise(ahead);
    v3_cross(ahead, up, right);
    v3_normalise(right);
    v3_cross(ahead, right, down);
    *c = (Camera){.width = 300, .height = 200, .fx = 180, .fy = 180, .cx = 150, .cy = 100};
    const double *row[3] = {right, down, ahead};
    for (int i = 0; i < 3; i++) {
        memcpy(c->w2c + 4 * i, row[i], sizeof right);
        c->w2c[4 * i + 3] = -v3_dot(row[i], centre[v]);
    }
    views[v] = &view[v];
}

// The cell of the photo that shows a point; it is to be in the photo.
static int seen_at(int v, const double point[3])
{
    double at[2];
    const Camera *c = &view[v].camera;
    assert_true(fs_camera_project(c, point, at) > 0);
    int x = (int)(at[0] / c->width * OCCLUSION_WIDTH), y = (int)(at[1] / c->height * OCCLUSION_HEIGHT);
    assert_true(x >= 0 && x < OCCLUSION_WIDTH && y >= 0 && y < OCCLUSION_HEIGHT);
    return y * OCCLUSION_WIDTH + x;
}

// By how many cells, at most, a thing wanders in the portrait of a kind. point: (N, 3), where it is for each photo.
static int wanders(PortraitKind kind, double point[N][3])
{
    PortraitAxes axes[N];
    int low[2] = {REGION_SIDE, REGION_SIDE}, high[2] = {-1, -1};
    fs_portrait_axes_direct(axes, kind, views, N);
    for (int v = 0; v < N; v++) {
        int cell = fs_portrait_axes_cell(&axes[v], &view[v].camera, seen_at(v, point[v]));
        assert_true(cell >= 0);
        const int at[2] = {cell % REGION_SIDE, cell / REGION_SIDE};
        for (int k = 0; k < 2; k++)
            low[k] = at[k] < low[k] ? at[k] : low[k], high[k] = at[k] > high[k] ? at[k] : high[k];
    }
    return (int)fmax(high[0] - low[0], high[1] - low[1]);
}

// An upright pane at y = 0; one walks along it and turns to its middle.
static void before_a_window(void)
{
    for (int v = 0; v < N; v++) {
        double x = -0.4 + 0.8 * v / (N - 1), z = 1.5 + 0.1 * (v % 3);
        stand(v, x, -1.5, z, (const double[3]){0.35 - 0.5 * x, 1, 0.1 - 0.1 * (v % 3)});
    }
}

static void test_goes_with_the_camera(void **state)
{
    (void)state;
    double image[N][3], still[N][3], spread = 0;
    before_a_window();
    assert_true(fs_portrait_axes_tilt(views, N) < 0.1);
    for (int v = 0; v < N; v++) spread += (centre[v][0] * centre[v][0] + pow(centre[v][2] - 1.6, 2)) / N;
    for (int v = 0; v < N; v++) {
        for (int k = 0; k < 3; k++) image[v][k] = k == 1 ? -centre[v][k] : centre[v][k]; // of the head
        image[v][0] += 0.5;
        still[v][0] = 0.9, still[v][1] = -1.5 + sqrt(spread) / 0.12, still[v][2] = 1.4; // what moves by 0.12, rms
    }
    assert_true(wanders(PORTRAIT_LEVEL, image) <= 2);
    assert_true(wanders(PORTRAIT_TURNED, image) > 5);
    assert_true(wanders(PORTRAIT_STILL, image) > 10);
    assert_true(wanders(PORTRAIT_STILL, still) <= 4); // what is not straight ahead is a little farther
    assert_true(wanders(PORTRAIT_LEVEL, still) > 10);
}

// A pane that lies; one walks around it and looks down at its middle.
static void test_turns_with_the_camera(void **state)
{
    (void)state;
    double image[N][3];
    for (int v = 0; v < N; v++) {
        double angle = -0.5 + 1.0 * v / (N - 1), out[3] = {sin(angle), -cos(angle), 0};
        stand(v, out[0], out[1], 1, (const double[3]){-out[0], -out[1], -1});
        for (int k = 0; k < 3; k++) image[v][k] = out[k] * 0.4;
        image[v][2] = -1; // under the pane, at z = 0; a hand held out
    }
    assert_true(fs_portrait_axes_tilt(views, N) > 0.6);
    assert_true(wanders(PORTRAIT_TURNED, image) <= 2);
    assert_true(wanders(PORTRAIT_LEVEL, image) > 5);
}

static void test_looks_past(void **state)
{
    (void)state;
    PortraitAxes axes[N];
    before_a_window();
    fs_portrait_axes_direct(axes, PORTRAIT_LEVEL, views, N);
    Camera back = view[0].camera; // turned around: behind the portrait
    for (int k = 0; k < 3; k++) back.w2c[k] *= -1, back.w2c[8 + k] *= -1;
    for (int cell = 0; cell < OCCLUSION_CELLS; cell += 7)
        assert_int_equal(fs_portrait_axes_cell(&axes[0], &back, cell), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_goes_with_the_camera),
        cmocka_unit_test(test_turns_with_the_camera),
        cmocka_unit_test(test_looks_past),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

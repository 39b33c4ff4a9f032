// The spiral path: a closed loop of rigid poses around the mean camera that always look at the focus point.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>

#include "render/spiral.h"

// A camera at c that looks along +z of the world turned by yaw around the y axis.
static Camera camera_at(double x, double y, double z, double yaw)
{
    double s = sin(yaw), co = cos(yaw);
    double r[9] = {co, 0, -s, 0, 1, 0, s, 0, co}, c[3] = {x, y, z};
    Camera camera = {.width = 300, .height = 200, .fx = 320, .fy = 321, .cx = 149, .cy = 102};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) camera.w2c[4 * i + k] = r[3 * i + k];
        camera.w2c[4 * i + 3] = -(r[3 * i] * c[0] + r[3 * i + 1] * c[1] + r[3 * i + 2] * c[2]);
    }
    return camera;
}

#define N 11
static Spiral spiral_of_a_row(Camera cameras[N])
{
    for (int i = 0; i < N; i++) // a row along x, bent inwards
        cameras[i] = camera_at(3 + 0.1 * (i - 5), 1 + 0.02 * (i % 3 - 1), -2, -0.04 * (i - 5));
    Spiral spiral;
    assert_int_equal(fs_spiral_fit(&spiral, cameras, N, 2, 6, NULL), 0);
    return spiral;
}

static void the_average_pose_is_the_middle_of_the_row(void **state)
{
    (void)state;
    Camera cameras[N];
    Spiral s = spiral_of_a_row(cameras);
    assert_float_equal(s.centre[0], 3, 1e-6);
    assert_float_equal(s.centre[2], -2, 1e-6);
    assert_float_equal(s.forward[2], 1, 1e-6);
    assert_float_equal(s.down[1], 1, 1e-6);
    assert_float_equal(s.right[0], 1, 1e-6);
    assert_float_equal(s.radius[0], 0.5, 1e-6); // 90th percentile of |-0.5 .. 0.5| in steps of 0.1: 0.5
    assert_float_equal(s.radius[2], 0, 1e-6);
    assert_float_equal(s.focus_depth, 1 / (0.25 / 1.8 + 0.75 / 30), 1e-6);
}

static void every_frame_is_rigid_and_looks_at_the_focus(void **state)
{
    (void)state;
    Camera cameras[N];
    Spiral s = spiral_of_a_row(cameras);
    s.radius[2] = 0.1; // the row has no depth; let the path have some
    double focus[3], pixel[2];
    for (int k = 0; k < 3; k++) focus[k] = s.centre[k] + s.focus_depth * s.forward[k];
    for (int i = 0; i < 60; i++) {
        Camera c = fs_spiral_camera(&s, &cameras[0], i, 60);
        assert_true(fs_camera_project(&c, focus, pixel) > 0);
        assert_float_equal(pixel[0], c.cx, 1e-6);
        assert_float_equal(pixel[1], c.cy, 1e-6);
        assert_int_equal(c.width, 300);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                double dot = 0;
                for (int k = 0; k < 3; k++) dot += c.w2c[4 * a + k] * c.w2c[4 * b + k];
                assert_float_equal(dot, a == b, 1e-6);
            }
        assert_true(c.w2c[5] > 0.9); // upright: down stays down
        double centre[3];
        fs_camera_centre(&c, centre);
        for (int k = 0; k < 3; k++) assert_true(fabs(centre[k] - s.centre[k]) <= s.radius[k] + 1e-6);
    }
}

static void the_loop_is_closed_and_even(void **state)
{
    (void)state;
    Camera cameras[N];
    Spiral s = spiral_of_a_row(cameras);
    s.radius[2] = 0.1;
    Camera first = fs_spiral_camera(&s, &cameras[0], 0, 48), past = fs_spiral_camera(&s, &cameras[0], 48, 48);
    for (int k = 0; k < 12; k++) assert_float_equal(first.w2c[k], past.w2c[k], 1e-6);
    // the step from the last frame to the first is like the others
    double longest = 0, last = 0, before[3], now[3];
    for (int i = 0; i <= 48; i++) {
        Camera c = fs_spiral_camera(&s, &cameras[0], i, 48);
        fs_camera_centre(&c, now);
        if (i) last = hypot(hypot(now[0] - before[0], now[1] - before[1]), now[2] - before[2]);
        if (last > longest) longest = last;
        memcpy(before, now, sizeof now);
    }
    assert_true(last > 0 && last <= longest && longest < 4 * M_PI / 48 * 0.55);
    double middle[3], start[3]; // two turns, one rise: half-way it stands at the same x and y, on the way back in z
    Camera half = fs_spiral_camera(&s, &cameras[0], 24, 48), quarter = fs_spiral_camera(&s, &cameras[0], 12, 48);
    fs_camera_centre(&half, middle);
    fs_camera_centre(&first, start);
    assert_float_equal(middle[0], start[0], 1e-6);
    fs_camera_centre(&quarter, middle);
    assert_float_equal(middle[2] - s.centre[2], 0.1, 1e-6);
}

static void impossible_paths_are_refused(void **state)
{
    (void)state;
    FsError err = {0};
    Spiral s;
    Camera opposite[2] = {camera_at(0, 0, 0, 0), camera_at(0, 0, 1, M_PI)};
    assert_int_equal(fs_spiral_fit(&s, opposite, 2, 1, 2, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "opposite"));
    assert_int_equal(fs_spiral_fit(&s, opposite, 0, 1, 2, &err), FS_ERR_INPUT);
    assert_int_equal(fs_spiral_fit(&s, opposite, 1, 0, 2, &err), FS_ERR_INPUT);
    assert_int_equal(fs_spiral_fit(&s, opposite, 1, NAN, 2, &err), FS_ERR_INPUT);
    assert_int_equal(fs_spiral_fit(&s, opposite, 1, 1, INFINITY, &err), FS_ERR_INPUT);
    assert_int_equal(fs_spiral_fit(&s, opposite, 1, 1, 2, &err), 0); // one camera: stands still
    Camera only = fs_spiral_camera(&s, &opposite[0], 3, 7);
    for (int k = 0; k < 12; k++) assert_float_equal(only.w2c[k], opposite[0].w2c[k], 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_average_pose_is_the_middle_of_the_row),
        cmocka_unit_test(every_frame_is_rigid_and_looks_at_the_focus),
        cmocka_unit_test(the_loop_is_closed_and_even),
        cmocka_unit_test(impossible_paths_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

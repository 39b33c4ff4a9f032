// Similarities: known ones are found again, with and without wrong pairs, from points and from cameras.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>

#include "base/rng.h"
#include "model/similarity.h"

static Similarity known(void)
{
    Similarity s = {.scale = 0.37, .t = {1.5, -20, 3}};
    fs_camera_quat_to_rotation((double[4]){0.2, -0.7, 0.4, 0.5}, s.r);
    return s;
}

static void random_points(Rng *rng, double (*p)[3], int n)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) p[i][k] = 4 * fs_rng_normal(rng);
}

static void assert_close(const Similarity *a, const Similarity *b, double tolerance)
{
    assert_true(fabs(a->scale - b->scale) < tolerance);
    for (int i = 0; i < 9; i++) assert_true(fabs(a->r[i] - b->r[i]) < tolerance);
    for (int i = 0; i < 3; i++) assert_true(fabs(a->t[i] - b->t[i]) < 10 * tolerance);
}

static void test_points(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(1);
    double p[20][3], q[20][3];
    random_points(&rng, p, 20);
    Similarity s = known(), found;
    for (int n = 3; n <= 20; n++) {
        for (int i = 0; i < n; i++) fs_similarity_apply(&s, p[i], q[i]);
        assert_int_equal(fs_similarity_fit((const double(*)[3])p, (const double(*)[3])q, n, &found, NULL), 0);
        assert_close(&found, &s, 1e-9);
    }
    for (int i = 0; i < 20; i++) // a mirrored set has no similarity without reflection, but the rotation stays one
        q[i][0] = -q[i][0];
    FsError err;
    if (fs_similarity_fit((const double(*)[3])p, (const double(*)[3])q, 20, &found, &err) == 0) {
        const double *r = found.r;
        double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
        assert_true(fabs(det - 1) < 1e-9);
    }
}

static void test_degenerate(void **state)
{
    (void)state;
    double line[5][3];
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 3; k++) line[i][k] = (k + 1) * i;
    Similarity s;
    FsError err = {0};
    assert_int_equal(fs_similarity_fit((const double(*)[3])line, (const double(*)[3])line, 5, &s, &err), FS_ERR_INPUT);
    assert_int_equal(fs_similarity_fit((const double(*)[3])line, (const double(*)[3])line, 0, &s, &err), FS_ERR_INPUT);
    line[2][1] = NAN;
    assert_int_equal(fs_similarity_fit((const double(*)[3])line, (const double(*)[3])line, 5, &s, &err), FS_ERR_INPUT);
}

static void test_robust(void **state)
{
    (void)state;
    enum { N = 200 };
    Rng rng = fs_rng_new(3);
    static double p[N][3], q[N][3];
    random_points(&rng, p, N);
    random_points(&rng, q, N);
    Similarity s = known(), found;
    for (int i = 0; i < N; i++)
        if (i % 5 < 2) { // two fifths are right, off by a little noise
            fs_similarity_apply(&s, p[i], q[i]);
            for (int k = 0; k < 3; k++) q[i][k] += 1e-4 * fs_rng_normal(&rng);
        }
    int inliers;
    assert_int_equal(
        fs_similarity_fit_robust((const double(*)[3])p, (const double(*)[3])q, N, 1e-3, &found, &inliers, NULL), 0);
    assert_true(inliers >= 76 && inliers <= 82);
    assert_close(&found, &s, 1e-3);
}

static void test_cameras(void **state)
{
    (void)state;
    enum { N = 6 };
    Rng rng = fs_rng_new(4);
    Similarity s = known(), found;
    Camera from[N], to[N];
    for (int i = 0; i < N; i++) { // centres on a line, looking about
        double quat[4] = {1, 0.1 * fs_rng_normal(&rng), 0.1 * fs_rng_normal(&rng), 0.1 * fs_rng_normal(&rng)}, r[9];
        fs_camera_quat_to_rotation(quat, r);
        from[i] = (Camera){.width = 60, .height = 40, .fx = 50, .fy = 50, .cx = 30, .cy = 20};
        for (int k = 0; k < 3; k++) {
            memcpy(from[i].w2c + 4 * k, r + 3 * k, 3 * sizeof *r);
            from[i].w2c[4 * k + 3] = -(r[3 * k] * i);
        }
        to[i] = fs_similarity_camera(&s, &from[i]);
        double x[3] = {0.5 * i, 0.3, 5}, y[3], a[2], b[2]; // the moved camera sees the moved point at the same pixel
        fs_similarity_apply(&s, x, y);
        double z = fs_camera_project(&from[i], x, a);
        assert_true(fabs(fs_camera_project(&to[i], y, b) - s.scale * z) < 1e-9);
        assert_true(fabs(a[0] - b[0]) + fabs(a[1] - b[1]) < 1e-9);
    }
    assert_int_equal(fs_similarity_fit_cameras(from, to, N, &found, NULL), 0);
    assert_close(&found, &s, 1e-9);
    assert_int_equal(fs_similarity_fit_cameras(from, to, 1, &found, NULL), FS_ERR_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_points), cmocka_unit_test(test_degenerate),
                                       cmocka_unit_test(test_robust), cmocka_unit_test(test_cameras)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// The k-d tree against a search through all points; few points, equal points, no dependence on threads.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/knn.h"
#include "base/rng.h"

enum { N = 700, K = 7 };

// The definition: all others, sorted by (distance, index).
static void nearest_slow(const float *xyz, int n, const float q[3], int skip, int k, int *index, float *dist2)
{
    for (int j = 0; j < k; j++) {
        index[j] = -1;
        dist2[j] = INFINITY;
        for (int i = 0; i < n; i++) {
            float x = xyz[3 * i] - q[0], y = xyz[3 * i + 1] - q[1], z = xyz[3 * i + 2] - q[2];
            float d = x * x + y * y + z * z;
            int taken = i == skip;
            for (int l = 0; l < j; l++) taken |= index[l] == i;
            if (!taken && d < dist2[j]) {
                dist2[j] = d;
                index[j] = i;
            }
        }
    }
}

static void check_points(const float *xyz, int n, int k)
{
    int *index = calloc((size_t)(n * k), sizeof *index), *one = calloc((size_t)(n * k), sizeof *one);
    float *dist2 = calloc((size_t)(n * k), sizeof *dist2);
    Threads *threads = fs_threads_new(3);
    assert_int_equal(fs_knn(xyz, n, k, index, dist2, threads), 0);
    assert_int_equal(fs_knn(xyz, n, k, one, NULL, NULL), 0);
    assert_memory_equal(index, one, sizeof *index * (size_t)(n * k));
    for (int i = 0; i < n; i++) {
        int want[K];
        float want2[K];
        nearest_slow(xyz, n, xyz + 3 * i, i, k, want, want2);
        assert_memory_equal(want, index + i * k, sizeof *want * (size_t)k);
        assert_memory_equal(want2, dist2 + i * k, sizeof *want2 * (size_t)k);
    }
    fs_threads_free(threads);
    free(index);
    free(one);
    free(dist2);
}

static void test_random(void **state)
{
    (void)state;
    float xyz[3 * N];
    Rng rng = fs_rng_new(5);
    for (int i = 0; i < 3 * N; i++) xyz[i] = fs_rng_normal(&rng) * (i % 3 == 2 ? 10.0f : 0.3f);
    check_points(xyz, N, K);
    check_points(xyz, 9, 3);
}

static void test_equal_points(void **state)
{
    (void)state;
    float xyz[3 * N];
    for (int i = 0; i < N; i++) {
        xyz[3 * i] = (float)(i % 2);
        xyz[3 * i + 1] = (float)(i / 5 % 3);
        xyz[3 * i + 2] = 1;
    }
    check_points(xyz, N, K);
}

static void test_few_points(void **state)
{
    (void)state;
    float xyz[] = {0, 0, 0, 1, 0, 0}, dist2[6];
    int index[6];
    assert_int_equal(fs_knn(xyz, 2, 3, index, dist2, NULL), 0);
    assert_int_equal(index[0], 1);
    assert_int_equal(index[1], -1);
    assert_true(isinf(dist2[1]));
    assert_int_equal(fs_knn(xyz, 0, 3, index, dist2, NULL), 0);
    xyz[4] = NAN;
    assert_int_equal(fs_knn(xyz, 2, 1, index, dist2, NULL), FS_ERR_NUMERIC);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_equal_points),
        cmocka_unit_test(test_few_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

// Regions of small grids: closed, filled, and only those that are large and sure.
#include "train/region.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { W = 40, H = 30 };

static float cells[W * H];
static Region region;

static void box(int x0, int y0, int x1, int y1, float value)
{
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) cells[y * W + x] = value;
}

static int find(RegionRule rule)
{
    int n = 0;
    region.width = W, region.height = H;
    fs_region_find(&region, cells, &rule);
    for (int i = 0; i < W * H; i++) n += region.in[i];
    return n;
}

static void test_ring_is_filled(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    assert_int_equal(find((RegionRule){0.3f, 0.3f, 2, 10}), 0);
    box(10, 8, 24, 22, 1);
    box(13, 11, 21, 19, 0); // the middle
    box(16, 8, 18, 11, 0);  // and a gap in the ring
    int n = find((RegionRule){0.3f, 0.5f, 2, 10});
    assert_true(n >= 14 * 14 - 16 && n <= 16 * 16);
    assert_true(region.in[15 * W + 17]); // of the middle
    assert_false(region.in[15 * W + 5]);
    assert_false(region.in[2 * W + 17]);
}

static void test_what_is_left_out(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(5, 5, 15, 15, 0.45f);  // large, not sure
    box(30, 20, 33, 23, 1.0f); // sure, small
    assert_int_equal(find((RegionRule){0.3f, 0.6f, 1, 30}), 0);
    box(8, 8, 12, 12, 1.0f);
    assert_true(find((RegionRule){0.3f, 0.6f, 1, 30}) >= 80);
    assert_true(region.in[6 * W + 6] && !region.in[21 * W + 31]);
    assert_true(find((RegionRule){0.3f, 0.6f, 1, 3}) >= 85); // both
    assert_true(region.in[21 * W + 31]);
    memset(cells, 0, sizeof cells);
    box(0, 0, W, H, 1);
    assert_int_equal(find((RegionRule){0.3f, 0.6f, 1, 30}), W * H);
}

static void test_hole_at_the_edge_stays(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(10, 15, 30, H, 1);
    box(15, 20, 25, H, 0);
    find((RegionRule){0.3f, 0.6f, 1, 30});
    assert_true(region.in[17 * W + 20]);
    assert_false(region.in[(H - 1) * W + 20]);
}

// A figure of shoulders and a head; 3 heights of 6 columns are 18 rows.
static void test_upper_body_is_completed(void **state)
{
    (void)state;
    for (int whole = 0; whole < 2; whole++) {
        region.width = W, region.height = H;
        memset(region.in, 0, sizeof region.in);
        for (int y = 4; y < (whole ? 14 : 10); y++)
            for (int x = 10; x < 16; x++) region.in[y * W + x] = y >= 6 || (x >= 12 && x < 14);
        fs_region_complete(&region, 1.5, 3);
        for (int y = 0; y < H; y++) {
            int end = whole ? 14 : 22;
            assert_int_equal(region.in[y * W + 10], y >= 6 && y < end);
            assert_int_equal(region.in[y * W + 12], y >= 4 && y < end);
            assert_int_equal(region.in[y * W + 9] + region.in[y * W + 16], 0);
        }
    }
    memset(region.in, 0, sizeof region.in);
    fs_region_complete(&region, 1.5, 3);
    assert_null(memchr(region.in, 1, sizeof region.in));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ring_is_filled), cmocka_unit_test(test_what_is_left_out),
                                       cmocka_unit_test(test_hole_at_the_edge_stays),
                                       cmocka_unit_test(test_upper_body_is_completed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

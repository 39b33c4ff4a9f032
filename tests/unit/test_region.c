// Regions of small grids: closed, filled, and only those that are large and stand out.
#include "train/region.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "train/trainer.h"

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
    assert_int_equal(find((RegionRule){0.3f, 0.3f, 2, 10, false}), 0);
    box(10, 8, 24, 22, 1);
    box(13, 11, 21, 19, 0); // the middle
    box(16, 8, 18, 11, 0);  // and a gap in the ring
    int n = find((RegionRule){0.3f, 0.4f, 2, 10, false});
    assert_true(n >= 14 * 14 - 16 && n <= 16 * 16);
    assert_true(region.in[15 * W + 17]); // of the middle
    assert_false(region.in[15 * W + 5]);
    assert_false(region.in[2 * W + 17]);
}

static void test_what_is_left_out(void **state)
{
    (void)state;
    box(0, 0, W, H, 0.2f);
    box(5, 5, 15, 15, 0.45f);  // large, and 0.25 above what is around it
    box(30, 20, 33, 23, 1.0f); // stands out, small
    assert_int_equal(find((RegionRule){0.3f, 0.3f, 1, 30, false}), 0);
    box(8, 8, 12, 12, 1.0f);
    assert_true(find((RegionRule){0.3f, 0.3f, 1, 30, false}) >= 80);
    assert_true(region.in[6 * W + 6] && !region.in[21 * W + 31]);
    assert_true(find((RegionRule){0.3f, 0.3f, 1, 3, false}) >= 85); // both
    assert_true(region.in[21 * W + 31]);
    box(0, 0, W, H, 1);
    assert_int_equal(find((RegionRule){0.3f, 0.3f, 1, 30, false}), W * H);
}

// What nothing is known of (0) does not make its neighbours stand out.
static void test_beside_what_is_not_seen(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(0, 0, 20, H, 0.3f);
    box(14, 10, 20, 20, 0.4f);
    assert_int_equal(find((RegionRule){0.35f, 0.15f, 0, 30, false}), 0);
    box(14, 10, 20, 20, 0.5f);
    assert_true(find((RegionRule){0.35f, 0.15f, 0, 30, false}) >= 50);
}

// An arm and a leg, and the belt: what is between them in a row or a column belongs to them, what is beside does not.
static void test_bite_is_filled(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(10, 5, 24, 10, 1);
    box(10, 10, 15, 20, 1);
    box(10, 20, 24, 24, 1);
    find((RegionRule){0.3f, 0.3f, 1, 30, false});
    assert_true(region.in[15 * W + 20] && region.in[15 * W + 12]);
    assert_false(region.in[15 * W + 28]);
    assert_false(region.in[2 * W + 20]);
}

// Head and feet that stand out, and nothing of what is between: one figure.
static void test_parts_are_one(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(10, 4, 16, 9, 1);
    box(10, 21, 16, 26, 1);
    find((RegionRule){0.3f, 0.3f, 1, 20, true});
    for (int y = 6; y < 24; y++) assert_true(region.in[y * W + 12]);
    assert_false(region.in[15 * W + 20]);
    assert_false(region.in[28 * W + 12]);
    find((RegionRule){0.3f, 0.3f, 1, 20, false}); // two
    assert_false(region.in[15 * W + 12]);
}

// A figure, and a bright strip above it that reaches far to a side: the strip is none of it, a hat would be.
static void test_what_is_beside_the_figure(void **state)
{
    (void)state;
    memset(cells, 0, sizeof cells);
    box(12, 10, 20, 27, 1);
    box(10, 3, 36, 6, 1);
    find((RegionRule){0.3f, 0.3f, 1, 20, true});
    assert_true(region.in[15 * W + 15]);
    assert_false(region.in[4 * W + 15] || region.in[4 * W + 30] || region.in[8 * W + 15]);
    find((RegionRule){0.3f, 0.3f, 1, 20, false});
    assert_true(region.in[4 * W + 30]);
    box(10, 3, 36, 6, 0);
    box(9, 3, 23, 6, 1);
    find((RegionRule){0.3f, 0.3f, 1, 20, true});
    assert_true(region.in[4 * W + 15] && region.in[8 * W + 15] && region.in[15 * W + 15]);
    box(28, 12, 34, 20, 1); // an arm, farther to the side than that, but no strip
    find((RegionRule){0.3f, 0.3f, 1, 20, true});
    assert_true(region.in[15 * W + 30] && region.in[15 * W + 24]);
}

// Shoulders and a head; 3 of 6 columns are 18 rows from the top.
static void test_figure_is_completed(void **state)
{
    (void)state;
    region.width = W, region.height = H;
    memset(region.in, 0, sizeof region.in);
    for (int y = 4; y < 10; y++)
        for (int x = 10; x < 16; x++) region.in[y * W + x] = y >= 6 || (x >= 12 && x < 14);
    fs_region_complete(&region, 3, false);
    for (int y = 0; y < H; y++) {
        assert_int_equal(region.in[y * W + 10], y >= 6 && y < 22);
        assert_int_equal(region.in[y * W + 12], y >= 4 && y < 22);
        assert_int_equal(region.in[y * W + 9] + region.in[y * W + 16], 0);
    }
    memset(region.in, 0, sizeof region.in); // head first, as a case mirrors it
    for (int y = 20; y < 26; y++)
        for (int x = 10; x < 16; x++) region.in[y * W + x] = y < 24 || (x >= 12 && x < 14);
    fs_region_complete(&region, 3, true);
    for (int y = 0; y < H; y++) {
        assert_int_equal(region.in[y * W + 10], y >= 8 && y < 24);
        assert_int_equal(region.in[y * W + 12], y >= 8 && y < 26);
    }
    memset(region.in, 0, sizeof region.in);
    fs_region_complete(&region, 3, false);
    assert_null(memchr(region.in, 1, sizeof region.in));
}

// A faint figure is clearer than noise in more cells, whose squares are more.
static void test_clarity(void **state)
{
    (void)state;
    static float figure[REGION_SIDE * REGION_SIDE], noise[REGION_SIDE * REGION_SIDE];
    static bool fewer[REGION_SIDE * REGION_SIDE], more[REGION_SIDE * REGION_SIDE];
    double squares[2] = {0};
    unsigned random = 1;
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++) {
        int x = i % REGION_SIDE, y = i / REGION_SIDE;
        random = random * 1664525 + 1013904223;
        fewer[i] = x >= 32 && x < 96 && y >= 32 && y < 96;
        more[i] = x >= 8 && x < 120 && y >= 8 && y < 120;
        figure[i] = x >= 50 && x < 80 && y >= 32 && y < 66 ? 0.6f : 0;
        noise[i] = more[i] && random >> 28 == 0 ? 0.9f : 0;
        squares[0] += (double)figure[i] * (double)figure[i];
        squares[1] += (double)noise[i] * (double)noise[i];
    }
    assert_true(squares[0] < squares[1]);
    assert_true(fs_region_clarity(figure, fewer) > 1.5 * fs_region_clarity(noise, more));
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++) figure[i] = fewer[i] ? 0.4f : 0; // even: nothing stands out
    assert_true(fabs(fs_region_clarity(figure, fewer)) < 1e-3);
    assert_true(fs_region_clarity(figure, (const bool[REGION_SIDE * REGION_SIDE]){0}) == 0);
}

// Cells that passers-by are found in, of eight photos, every other one with the flash, where those of `who` (bits) have
// something that their scenes do not explain.
static int passers(unsigned who, bool found[8])
{
    static const View lit = {.flash = true}, unlit = {0};
    const View *views[8];
    FsProject project = {0};
    Trainer trainer = {.project = &project, .views = views, .n_views = 8};
    int n = 0;
    trainer.residual = calloc(8 * OCCLUSION_CELLS, 3 * sizeof(float));
    assert_non_null(trainer.residual);
    for (int v = 0; v < 8; v++) {
        views[v] = v % 2 ? &lit : &unlit;
        for (int y = 10; y < 22 && who >> v & 1; y++)
            for (int x = 20; x < 32; x++) trainer.residual[3 * (OCCLUSION_CELLS * v + OCCLUSION_WIDTH * y + x)] = 0.3f;
    }
    assert_int_equal(fs_passers_by_find(&trainer, NULL), 0);
    assert_null(trainer.residual);
    for (int v = 0; v < 8; v++) {
        found[v] = trainer.passers[OCCLUSION_CELLS * v + OCCLUSION_WIDTH * 15 + 25];
        for (int i = 0; i < OCCLUSION_CELLS; i++) n += trainer.passers[OCCLUSION_CELLS * v + i];
    }
    free(trainer.passers);
    return n;
}

static void test_passers_by(void **state)
{
    (void)state;
    bool found[8];
    assert_int_equal(passers(0, found), 0);
    assert_in_range(passers(1 << 2 | 1 << 5, found), 288, 600); // two photos of 12 x 12 cells, and what is near
    for (int v = 0; v < 8; v++) assert_int_equal(found[v], v == 2 || v == 5);
    assert_true(passers(0xaa, found) > 0); // all with the flash: its mirror image
    for (int v = 0; v < 8; v++) assert_int_equal(found[v], v % 2);
    assert_true(passers(0x15, found) > 0);     // three of four without
    assert_int_equal(passers(0x55, found), 0); // all of them, or all photos: nobody
    assert_int_equal(passers(0xff, found), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ring_is_filled),
                                       cmocka_unit_test(test_what_is_left_out),
                                       cmocka_unit_test(test_beside_what_is_not_seen),
                                       cmocka_unit_test(test_bite_is_filled),
                                       cmocka_unit_test(test_parts_are_one),
                                       cmocka_unit_test(test_what_is_beside_the_figure),
                                       cmocka_unit_test(test_figure_is_completed),
                                       cmocka_unit_test(test_clarity),
                                       cmocka_unit_test(test_passers_by)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

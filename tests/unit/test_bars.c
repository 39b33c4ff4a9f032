// Bars before the glass: which covered Gaussians are some, and what T is lent of R to find them among.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "train/trainer.h"

enum { VIEWS = 4, SIDE = 40, ACROSS = 5, ALONG = 60, WALL = SIDE * SIDE, BAR = ACROSS * ALONG };

// A wall 4 before the cameras, and before it, 2 before them, a bar: T, in this order.
typedef struct Fixture {
    Trainer trainer;
    View view[VIEWS];
    const View *views[VIEWS];
} Fixture;

static void put(Cloud *cloud, int i, double x, double y, double z)
{
    float *mean = cloud->field[CLOUD_MEANS] + 3 * (size_t)i;
    mean[0] = (float)x;
    mean[1] = (float)y;
    mean[2] = (float)z;
}

static void set_up(Fixture *f)
{
    *f = (Fixture){0};
    for (int v = 0; v < VIEWS; v++) {
        f->view[v].camera = (Camera){.width = 100, .height = 100, .fx = 100, .fy = 100, .cx = 50, .cy = 50};
        for (int k = 0; k < 3; k++) f->view[v].camera.w2c[5 * k] = 1;
        f->view[v].camera.w2c[3] = 0.2 * v - 0.3;
        f->views[v] = &f->view[v];
    }
    f->trainer.views = f->views;
    f->trainer.n_views = VIEWS;
    f->trainer.dataset = (Dataset){.view = f->view, .n = VIEWS};
    f->trainer.scene.pane.normal[2] = 1;
    Cloud *T = &f->trainer.scene.cloud[LAYER_T_N];
    assert_int_equal(fs_cloud_new(T, WALL + BAR, 3, 1, NULL), 0);
    for (int i = 0; i < WALL; i++) put(T, i, 0.1 * (i % SIDE) - 2, 0.1 * (i / SIDE) - 2, 4);
    for (int i = 0; i < BAR; i++) put(T, WALL + i, 0.04 * (i % ACROSS) - 0.08, 0.05 * (i / ACROSS) - 1.5, 2);
    for (int i = 0; i < T->n; i++) T->field[CLOUD_GAINS][i] = i < WALL ? 0.5f : 2;
}

static void tear_down(Fixture *f)
{
    for (int l = 0; l < LAYERS; l++) fs_cloud_free(&f->trainer.scene.cloud[l]);
}

// Whether bars are found where from <= i < to were learned to be covered.
static int found_where(Fixture *f, int from, int to, int step)
{
    Cloud *T = &f->trainer.scene.cloud[LAYER_T_N], learned = {0};
    assert_int_equal(fs_cloud_covers(T, true, NULL), 0);
    assert_int_equal(fs_cloud_copy(&learned, T, NULL), 0);
    for (int i = 0; i < T->n; i++) learned.field[CLOUD_COVERS][i] = i >= from && i < to && i % step < 8 ? 0.95f : 0.1f;
    int found = fs_bars_decide(&f->trainer, &learned, 0.009, NULL);
    fs_cloud_free(&learned);
    assert_int_equal(found, T->width[CLOUD_COVERS]);
    return found;
}

static void test_before_the_glass(void **state)
{
    (void)state;
    Fixture f;
    set_up(&f);
    Cloud *T = &f.trainer.scene.cloud[LAYER_T_N];
    assert_int_equal(found_where(&f, WALL, WALL + BAR, 8), 1);
    int covered = 0;
    for (int i = 0; i < T->n; i++) {
        assert_true(T->field[CLOUD_COVERS][i] == 0 || (i >= WALL && T->field[CLOUD_COVERS][i] == 1));
        covered += T->field[CLOUD_COVERS][i] > 0;
    }
    assert_true(covered > BAR / 2);
    f.trainer.scene.rare = 1; // little is mirrored: what is around must lie behind it all the more
    assert_int_equal(found_where(&f, WALL, WALL + BAR, 8), 1);
    for (int i = 0; i < WALL; i += 2) put(T, i, T->field[CLOUD_MEANS][3 * i], T->field[CLOUD_MEANS][3 * i + 1], 1.6);
    assert_int_equal(found_where(&f, WALL, WALL + BAR, 8), 0);
    f.trainer.scene.rare = 0;
    assert_int_equal(found_where(&f, WALL, WALL + BAR, 8), 1);
    for (int i = 0; i < WALL; i += 2) put(T, i, T->field[CLOUD_MEANS][3 * i], T->field[CLOUD_MEANS][3 * i + 1], 4);
    assert_int_equal(found_where(&f, 0, WALL, SIDE), 0);       // a strip of the wall, with the wall around it
    assert_int_equal(found_where(&f, WALL, WALL + 2, 8), 0);   // too few
    assert_int_equal(found_where(&f, 0, 0, 8), 0);             // none
    assert_int_equal(found_where(&f, 0, WALL + BAR, SIDE), 0); // all along a strip, of both
    tear_down(&f);
}

enum { ROOM = 500, NEAR = 50 };

// The mirrored room, and every tenth of it as near as the bar.
static void add_room(Fixture *f)
{
    Cloud *R = &f->trainer.scene.cloud[LAYER_R];
    assert_int_equal(fs_cloud_new(R, ROOM, 3, 0, NULL), 0);
    for (int i = 0; i < ROOM; i++) {
        put(R, i, 0.001 * i, 0, i % (ROOM / NEAR) ? 6 : 2.1);
        R->field[CLOUD_COLORS][3 * i] = (float)i;
    }
}

static bool is_same(const Cloud *a, const Cloud *b)
{
    bool same = a->n == b->n;
    for (int k = 0; k < CLOUD_FIELDS && same; k++)
        same = a->width[k] == b->width[k] &&
               (!a->width[k] || !memcmp(a->field[k], b->field[k], sizeof(float) * (size_t)(a->n * a->width[k])));
    return same;
}

static void test_loan(void **state)
{
    (void)state;
    Fixture f;
    BarsLoan loan = {{0}};
    Cloud was[2] = {{0}};
    set_up(&f);
    add_room(&f);
    Cloud *T = &f.trainer.scene.cloud[LAYER_T_N], *R = &f.trainer.scene.cloud[LAYER_R];
    assert_int_equal(fs_cloud_copy(&was[0], T, NULL), 0);
    assert_int_equal(fs_cloud_copy(&was[1], R, NULL), 0);
    assert_int_equal(fs_bars_loan_make(&f.trainer, &loan, NULL), NEAR);
    assert_true(T->n == WALL + BAR + NEAR && R->n == ROOM - NEAR);
    for (int i = 0; i < NEAR; i++) {
        size_t at = (size_t)(WALL + BAR + i);
        assert_true(T->field[CLOUD_COLORS][3 * at] == (float)(i * (ROOM / NEAR)) && T->field[CLOUD_GAINS][at] == 0.5f);
    }
    assert_int_equal(fs_bars_loan_settle(&f.trainer, &loan, NULL), 0); // nothing is covered: all as it was
    assert_true(is_same(T, &was[0]) && is_same(R, &was[1]));
    fs_bars_loan_free(&loan);

    assert_int_equal(fs_bars_loan_make(&f.trainer, &loan, NULL), NEAR);
    assert_int_equal(fs_cloud_covers(T, true, NULL), 0);
    for (int i = 0; i < 3; i++) T->field[CLOUD_COVERS][WALL + BAR + 7 * i] = 1;
    assert_int_equal(fs_bars_loan_settle(&f.trainer, &loan, NULL), 0);
    assert_true(T->n == WALL + BAR + 3 && R->n == ROOM - 3);
    for (int i = 0; i < 3; i++) assert_true(T->field[CLOUD_COLORS][3 * (WALL + BAR + i)] == (float)(70 * i));
    for (int i = 0; i < R->n; i++) assert_true((int)R->field[CLOUD_COLORS][3 * i] != 70);
    fs_bars_loan_free(&loan);

    assert_int_equal(fs_bars_loan_make(&f.trainer, &loan, NULL), NEAR - 3); // what was covered before stays so
    assert_int_equal(fs_cloud_covers(T, false, NULL), 0);
    assert_int_equal(fs_bars_loan_settle(&f.trainer, &loan, NULL), 0);
    assert_true(T->n == WALL + BAR + 3 && R->n == ROOM - 3 && T->width[CLOUD_COVERS] == 1);
    for (int i = 0; i < T->n; i++) assert_true(T->field[CLOUD_COVERS][i] == (i < WALL + BAR ? 0 : 1));
    fs_bars_loan_free(&loan);

    for (int i = 0; i < R->n; i++) put(R, i, 0, 0, 6); // nothing of it is near
    assert_int_equal(fs_bars_loan_make(&f.trainer, &loan, NULL), 0);
    assert_int_equal(T->n, WALL + BAR + 3);
    fs_bars_loan_free(&loan);
    for (int i = 0; i < R->n; i++) put(R, i, 0, 0, 2.1); // all of it is
    assert_int_equal(fs_bars_loan_make(&f.trainer, &loan, NULL), 0);
    assert_true(T->n == WALL + BAR + 3 && R->n == ROOM - 3);
    fs_bars_loan_free(&loan);
    for (int k = 0; k < 2; k++) fs_cloud_free(&was[k]);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_before_the_glass), cmocka_unit_test(test_loan)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

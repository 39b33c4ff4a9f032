// Dirt on the pane: found where flash photos hold light that moves as a plane does, and only there.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/rng.h"
#include "engine/as_shot.h"
#include "engine/dirt.h"
#include "image/blur.h"

enum { W = 120, H = 80, PHOTOS = 16, N = 300 };

// A wall of Gaussians behind a pane.
static Scene make_scene(void)
{
    Scene s = {.shared_geometry = true,
               .pane_beta = true,
               .pane = {{0.3, 0, 0.954}, 0.1, 0.1},
               .gain_color = {1.4, 1.2, 0.9},
               .flash_distance = 2.5,
               .extent = 0.5};
    Rng rng = fs_rng_new(5);
    Cloud *T = &s.cloud[LAYER_T_N];
    assert_int_equal(fs_cloud_new(T, N, 3, 1, NULL), 0);
    for (int i = 0; i < N; i++) {
        T->field[CLOUD_MEANS][3 * i] = 5 * (fs_rng_uniform(&rng) - 0.5f);
        T->field[CLOUD_MEANS][3 * i + 1] = 4 * (fs_rng_uniform(&rng) - 0.5f);
        T->field[CLOUD_MEANS][3 * i + 2] = 2.4f + 0.2f * fs_rng_uniform(&rng);
        for (int k = 0; k < 3; k++) T->field[CLOUD_SCALES][3 * i + k] = -1.6f;
        T->field[CLOUD_QUATS][4 * i] = 1;
        T->field[CLOUD_OPACITIES][i] = 2;
        for (int k = 0; k < 3; k++) T->field[CLOUD_COLORS][3 * i + k] = 0.4f + 0.4f * fs_rng_uniform(&rng);
    }
    return s;
}

// Smears on a plane that is not quite where anybody would look for it.
static void make_veil(Scene *scene, double steep)
{
    double n[3] = {steep, -0.08, 1}, right[3] = {1, 0, -steep}, down[3];
    v3_normalise(n);
    v3_normalise(right);
    v3_cross(n, right, down);
    Veil veil = {.cell = 0.025, .distance = 1.1, .unit = 0.01};
    for (int k = 0; k < 3; k++) {
        veil.right[k] = right[k];
        veil.down[k] = down[k];
        veil.origin[k] = 1.1 * n[k] - veil.cell * (50 * right[k] + 40 * down[k]);
        veil.ambient[k] = 0.1;
    }
    Rng rng = fs_rng_new(8);
    assert_int_equal(fs_image_new(&veil.light, 100, 80, 1, NULL), 0);
    for (int blob = 0; blob < 250; blob++) {
        float x = 100 * fs_rng_uniform(&rng), y = 80 * fs_rng_uniform(&rng), bright = 0.03f * fs_rng_uniform(&rng);
        for (int j = 0; j < 80; j++)
            for (int i = 0; i < 100; i++) {
                float r2 = ((float)i - x) * ((float)i - x) + ((float)j - y) * ((float)j - y);
                *fs_image_at(&veil.light, i, j) += bright * expf(-r2 / 4);
            }
    }
    scene->veil = veil;
}

static Camera camera_of(int i)
{
    double x = 0.45 * sin(i * 0.8), y = 0.25 * cos(i * 1.3), a = 0.1 * sin(i * 2.1), c = cos(a), s = sin(a);
    return (Camera){W, H, 110, 110, 0.5 * W, 0.5 * H, {c, 0, s, -c * x, 0, 1, 0, -y, -s, 0, c, s * x}};
}

// As wide as a photo's own, once it is made small.
static void add_noise(Image *photo, Rng *rng)
{
    Image noise = {0};
    size_t n = fs_image_values(photo);
    float *room = malloc(sizeof *room * 2 * n);
    assert_non_null(room);
    assert_int_equal(fs_image_new(&noise, photo->width, photo->height, 3, NULL), 0);
    for (size_t i = 0; i < n; i++) noise.px[i] = 0.03f * fs_rng_normal(rng);
    fs_blur_image(&noise, room, room + n, 1.5f);
    for (size_t i = 0; i < n; i++) photo->px[i] += room[n + i];
    fs_image_free(&noise);
    free(room);
}

// What the scene and its veil show, with noise. kept: pixels of 13 that may be used.
static void take(Engine *engine, const Scene *scene, View *view, DirtPhoto *p, int kept, Rng *rng)
{
    Renders renders = {{{0}}};
    Image layers[2] = {{0}};
    *p = (DirtPhoto){.view = view, .camera = view->camera};
    assert_int_equal(fs_engine_render(engine, &view->camera, &renders, NULL), 0);
    assert_int_equal(fs_as_shot_layers_of(scene, &p->state, view, &view->camera, &renders, layers, NULL), 0);
    const float *T = renders.layer[view->flash ? RENDER_T_F : RENDER_T_N].px; // what is transmitted is without dirt
    for (size_t i = 0; i < fs_image_values(&layers[0]); i++) assert_true(fabsf(layers[0].px[i] - T[i]) < 1e-5f);
    p->photo = layers[1];
    add_noise(&p->photo, rng);
    assert_int_equal(fs_image_new(&p->mask, W, H, 1, NULL), 0);
    for (int i = 0; i < W * H; i++) p->mask.px[i] = i % 13 < kept;
    fs_image_free(&layers[0]);
    fs_engine_renders_free(&renders);
}

// Half of the Gaussians are not where they were when the photos were taken: every photo holds light beyond its render,
// most of it at their edges, and photos of either lighting agree about it where the wall is.
static void learn_badly(Scene *scene, float off)
{
    Cloud *T = &scene->cloud[LAYER_T_N];
    for (int i = 0; i < N; i += 2) T->field[CLOUD_MEANS][3 * i] += off;
}

typedef struct Case {
    bool dirty;
    float off;    // of half of the Gaussians
    double steep; // of the pane
    int kept, photos;
} Case;

static int search(const Case *is, Veil *found, Veil *truth)
{
    Scene scene = make_scene();
    View view[PHOTOS];
    DirtPhoto photo[PHOTOS];
    Engine *engine;
    Threads *threads = fs_threads_new(2);
    Rng rng = fs_rng_new(3);
    assert_non_null(threads);
    make_veil(&scene, is->steep);
    for (size_t i = 0; i < fs_image_values(&scene.veil.light) && !is->dirty; i++) scene.veil.light.px[i] = 0;
    assert_int_equal(fs_engine_new(&engine, "cpu", "best", 1, NULL), 0);
    assert_int_equal(fs_engine_scene_up(engine, &scene, NULL), 0);
    for (int i = 0; i < is->photos; i++) {
        view[i] = (View){.name = "photo", .flash = i % 2, .camera = camera_of(i)};
        take(engine, &scene, &view[i], &photo[i], is->kept, &rng);
    }
    *truth = scene.veil;
    scene.veil = (Veil){0};
    learn_badly(&scene, is->off);
    assert_int_equal(fs_engine_scene_up(engine, &scene, NULL), 0);
    DirtArgs args = {engine, &scene, threads, photo, is->photos};
    int rc = fs_dirt_find(&args, found, NULL);
    for (int i = 0; i < is->photos; i++) {
        fs_image_free(&photo[i].photo);
        fs_image_free(&photo[i].mask);
    }
    fs_engine_free(engine);
    fs_threads_free(threads);
    fs_scene_free(&scene);
    fs_image_free(&truth->light);
    return rc;
}

static void check_found(float off, double steep, int kept)
{
    Veil found = {0}, truth;
    double n[3], true_n[3], centre[3], foot[3], middle[3] = {0};
    assert_int_equal(search(&(Case){true, off, steep, kept, PHOTOS}, &found, &truth), 1);
    assert_int_equal(fs_pane_veil_check(&found, "veil", NULL), 0);
    v3_cross(found.right, found.down, n);
    v3_cross(truth.right, truth.down, true_n);
    assert_true(v3_dot(n, true_n) > cos(0.12));
    for (int i = 0; i < PHOTOS; i++) {
        Camera c = camera_of(i);
        fs_camera_centre(&c, centre);
        for (int k = 0; k < 3; k++) middle[k] += centre[k] / PHOTOS;
    }
    for (int k = 0; k < 3; k++) foot[k] = truth.origin[k] - middle[k];
    assert_true(fabs(found.distance / v3_dot(foot, true_n) - 1) < 0.05);
    double straight = 1 / (1 + steep * steep); // the flash is farther from what is aside
    assert_true(found.unit > 0.002 * straight && found.unit < 0.05 && found.light.px[0] > 0);
    for (size_t i = 0; i < fs_image_values(&found.light); i++) assert_true(found.light.px[i] == found.light.px[0]);
    for (int i = 1; i < PHOTOS; i += 2) { // all that flash photos see of the plane is on it
        Camera c = camera_of(i);
        fs_camera_centre(&c, centre);
        double h = v3_dot(
            (double[]){found.origin[0] - centre[0], found.origin[1] - centre[1], found.origin[2] - centre[2]}, n);
        for (int corner = 0; corner < 4; corner++) {
            double in[3] = {((corner & 1 ? W : 0) - c.cx) / c.fx, ((corner & 2 ? H : 0) - c.cy) / c.fy, 1}, ray[3];
            for (int k = 0; k < 3; k++) ray[k] = in[0] * c.w2c[k] + in[1] * c.w2c[4 + k] + in[2] * c.w2c[8 + k];
            double along = h / v3_dot(ray, n), at[2] = {0, 0};
            for (int k = 0; k < 3; k++) {
                at[0] += (centre[k] + along * ray[k] - found.origin[k]) * found.right[k] / found.cell;
                at[1] += (centre[k] + along * ray[k] - found.origin[k]) * found.down[k] / found.cell;
            }
            assert_true(at[0] >= 0 && at[0] < found.light.width - 1 && at[1] >= 0 && at[1] < found.light.height - 1);
        }
    }
    fs_image_free(&found.light);
}

static void test_found(void **state)
{
    (void)state;
    check_found(0, 0.12, 12);
    check_found(0.04f, 0.12, 12);
    check_found(0.15f, 0.12, 12); // most of what is left is the wall's
    check_found(0, 0.5, 12);
    check_found(0, 0.12, 6);
}

static void test_not_found(void **state)
{
    (void)state;
    Veil found = {0}, truth;
    assert_int_equal(search(&(Case){false, 0, 0.12, 12, PHOTOS}, &found, &truth), 0);
    assert_int_equal(search(&(Case){false, 0.04f, 0.12, 12, PHOTOS}, &found, &truth), 0);
    assert_int_equal(search(&(Case){false, 0.15f, 0.12, 12, PHOTOS}, &found, &truth), 0);
    assert_int_equal(search(&(Case){false, 0, 0.12, 12, PHOTOS - 1}, &found, &truth), 0);
    assert_int_equal(search(&(Case){true, 0, 0.12, 12, PHOTOS - 1}, &found, &truth), 0); // seven with the flash
    assert_false(fs_pane_veil_is(&found));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_found), cmocka_unit_test(test_not_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

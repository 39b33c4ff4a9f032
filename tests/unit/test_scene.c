// Scenes on disk: exact round trip, stale clouds go away, and wrong files are refused.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/owned.h"

#include "base/rng.h"
#include "image/tone.h"
#include "model/scene.h"
#include "temp_dir.h"

static void fill(Cloud *cloud, int n, int color_width, int gain_width, Rng *rng)
{
    assert_int_equal(fs_cloud_new(cloud, n, color_width, gain_width, NULL), 0);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < n * cloud->width[f]; i++) cloud->field[f][i] = fs_rng_normal(rng);
}

static void make_shared(Scene *scene)
{
    Rng rng = fs_rng_new(3);
    *scene = (Scene){.shared_geometry = true, .pane_beta = true, .separation = SEPARATION_LINEAR};
    fill(&scene->cloud[LAYER_T_N], 11, 3, 1, &rng);
    fill(&scene->cloud[LAYER_R], 7, 3, 0, &rng);
    const double normal[3] = {1.0 / 3, -2.0 / 3, 2.0 / 3};
    memcpy(scene->pane.normal, normal, sizeof normal);
    scene->pane.f0 = 0.1;
    scene->gain_color[0] = nextafter(1.5, 2), scene->gain_color[1] = M_PI, scene->gain_color[2] = 1e-300;
    scene->flash_distance = sqrt(2), scene->extent = 1.0 / 7, scene->metres_per_unit = 0x1.fffffffffffffp-3;
}

static void add_veil(Scene *scene)
{
    Rng rng = fs_rng_new(5);
    scene->veil = (Veil){.origin = {0.1, -1.0 / 3, 2},
                         .right = {0.6, 0.8, 0},
                         .down = {0, 0, 1},
                         .cell = 0.01,
                         .distance = 1.0 / 7,
                         .unit = 0.003,
                         .ambient = {0, 0.1, 1.0 / 3}};
    assert_int_equal(fs_image_new(&scene->veil.light, 5, 4, 1, NULL), 0);
    for (size_t i = 0; i < fs_image_values(&scene->veil.light); i++) scene->veil.light.px[i] = fs_rng_uniform(&rng);
}

static void make_separate(Scene *scene)
{
    Rng rng = fs_rng_new(4);
    *scene = (Scene){.extent = 1};
    for (int l = 0; l < LAYERS; l++) fill(&scene->cloud[l], 3 + l, fs_layers[l].channels, 0, &rng);
}

static void assert_same(const Scene *a, const Scene *b)
{
    assert_int_equal(a->shared_geometry, b->shared_geometry);
    assert_int_equal(a->pane_beta, b->pane_beta);
    assert_int_equal(a->separation, b->separation);
    assert_memory_equal(&a->pane, &b->pane, sizeof a->pane);
    assert_memory_equal(a->gain_color, b->gain_color, sizeof a->gain_color);
    assert_true(a->flash_distance == b->flash_distance && a->extent == b->extent);
    assert_true(a->metres_per_unit == b->metres_per_unit);
    assert_memory_equal(&a->veil, &b->veil, offsetof(Veil, light));
    assert_int_equal(fs_image_values(&a->veil.light), fs_image_values(&b->veil.light));
    if (fs_pane_veil_is(&a->veil))
        assert_memory_equal(a->veil.light.px, b->veil.light.px, sizeof(float) * fs_image_values(&a->veil.light));
    for (int l = 0; l < LAYERS; l++) {
        assert_int_equal(a->cloud[l].n, b->cloud[l].n);
        for (int f = 0; f < CLOUD_FIELDS && a->cloud[l].n; f++) {
            int width = a->cloud[l].width[f];
            assert_int_equal(width, b->cloud[l].width[f]);
            if (width)
                assert_memory_equal(a->cloud[l].field[f], b->cloud[l].field[f],
                                    sizeof(float) * (size_t)(width * a->cloud[l].n));
        }
    }
}

static void test_round_trip(void **state)
{
    char *dir = fs_file_path("%s/a/b", (char *)*state), *stale = fs_file_path("%s/T_F.ply", dir);
    assert_int_equal(fs_owned_open(dir, "project", NULL), 0); // a stale cloud is removed where it is ours
    for (int kind = 0; kind < 3; kind++) {                    // each overwrites the one before in the same folder
        Scene a, b;
        if (kind)
            make_shared(&a);
        else
            make_separate(&a);
        if (kind == 1) add_veil(&a);
        assert_int_equal(fs_scene_write(&a, dir, NULL), 0);
        assert_int_equal(fs_scene_read(&b, dir, NULL), 0);
        assert_same(&a, &b);
        assert_int_equal(fs_file_exists(stale), kind == 0);
        FileList list;
        assert_int_equal(fs_file_list(dir, &list, NULL), 0);
        assert_int_equal(list.n, kind == 0 ? 5 : kind == 1 ? 4 : 3);
        fs_file_list_free(&list);
        fs_scene_free(&a);
        fs_scene_free(&b);
    }
    free(stale);
    free(dir);
}

// A quarter of the light in all that a scene holds, and back.
static void test_lift(void **state)
{
    (void)state;
    const Layer lit[] = {LAYER_T_F, LAYER_T_N, LAYER_R};
    Scene a, b;
    make_separate(&a);
    add_veil(&a);
    assert_int_equal(fs_scene_copy(&b, &a, NULL), 0);
    fs_scene_lift(&b, 0.25);
    for (int l = 0; l < 3; l++)
        for (int i = 0; i < 3 * a.cloud[lit[l]].n; i++) {
            float was = fs_tone_decode(a.cloud[lit[l]].field[CLOUD_COLORS][i]);
            assert_float_equal(fs_tone_decode(b.cloud[lit[l]].field[CLOUD_COLORS][i]), 0.25f * was, 1e-4 * was);
        }
    for (size_t i = 0; i < fs_image_values(&a.veil.light); i++)
        assert_float_equal(b.veil.light.px[i], a.veil.light.px[i] / 4, 1e-9);
    assert_true(b.veil.unit == a.veil.unit / 4);
    assert_memory_equal(a.cloud[LAYER_BETA].field[CLOUD_COLORS], b.cloud[LAYER_BETA].field[CLOUD_COLORS],
                        sizeof(float) * (size_t)a.cloud[LAYER_BETA].n);
    fs_scene_lift(&b, 4);
    for (int i = 0; i < 3 * a.cloud[LAYER_R].n; i++)
        assert_float_equal(b.cloud[LAYER_R].field[CLOUD_COLORS][i], a.cloud[LAYER_R].field[CLOUD_COLORS][i], 1e-6);
    fs_scene_free(&a);
    fs_scene_free(&b);
}

// Replaces `from` by `to` in model.json and expects the scene to be refused.
static void refuse(const char *dir, const char *from, const char *to)
{
    char *path = fs_file_path("%s/model.json", dir), *text;
    size_t size;
    assert_int_equal(fs_file_read(path, 1 << 20, &text, &size, NULL), 0);
    char *at = strstr(text, from);
    assert_non_null(at);
    char *changed = fs_file_path("%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    assert_int_equal(fs_file_write(path, changed, strlen(changed), NULL), 0);
    Scene scene;
    FsError err = {0};
    assert_int_equal(fs_scene_read(&scene, dir, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, dir));
    assert_int_equal(scene.cloud[LAYER_T_N].n, 0);
    assert_int_equal(fs_file_write(path, text, size, NULL), 0);
    free(changed);
    free(text);
    free(path);
}

static void test_refused(void **state)
{
    char *dir = fs_file_path("%s/refused", (char *)*state);
    Scene a, b;
    make_shared(&a);
    assert_int_equal(fs_scene_write(&a, dir, NULL), 0);
    refuse(dir, "{", "[");
    refuse(dir, "\"version\": 2", "\"version\": 99");
    refuse(dir, "\"shared_geometry\": true", "\"shared_geometry\": 1");
    refuse(dir, "\"T_N\": 11", "\"T_N\": 10");
    refuse(dir, "\"T_N\": 11", "\"T_N\": \"11\"");
    refuse(dir, "\"T_N\": 11", "\"T_N\": 11, \"T_F\": 11");
    refuse(dir, "\"R\": 7", "\"R\": 7, \"beta\": 7");
    refuse(dir, "\"clouds\"", "\"other\"");
    refuse(dir, "\"extent\": 0.", "\"extent\": -0.");
    refuse(dir, "\"pane_f0\": 0", "\"pane_f0\": 7");
    refuse(dir, "\"gain_color\": [", "\"gain_color\": [1, ");
    refuse(dir, "\"pane_normal\"", "\"other\"");
    refuse(dir, "\"clouds\": {", "\"clouds\": {}, \"other\": {");
    // What would divide by zero later, or take its logarithm.
    refuse(dir, "\"pane_dimming\": 0.0", "\"pane_dimming\": 1.0");
    refuse(dir, "\"extent\": 0.", "\"extent\": 0.0, \"other\": 0.");
    refuse(dir, "\"flash_distance\": 1.", "\"flash_distance\": 0.0, \"other\": 1.");
    refuse(dir, "3.1415926535897931", "0.0");
    refuse(dir, "-0.66666666666666663", "0.5");
    for (int l = 0; l < LAYERS; l++) assert_int_equal(fs_scene_read(&b, dir, NULL), 0), fs_scene_free(&b);
    a.extent = NAN;
    assert_int_equal(fs_scene_write(&a, dir, NULL), FS_ERR_INPUT);
    a.extent = 1;
    for (int k = 0; k < 2; k++) { // covers from 0 to 1, and of T_N alone
        Cloud *cloud = &a.cloud[k ? LAYER_R : LAYER_T_N];
        assert_int_equal(fs_cloud_covers(cloud, true, NULL), 0);
        assert_int_equal(fs_scene_write(&a, dir, NULL), k ? FS_ERR_INPUT : 0);
        cloud->field[CLOUD_COVERS][1] = 1.01f;
        assert_int_equal(fs_scene_write(&a, dir, NULL), FS_ERR_INPUT);
        assert_int_equal(fs_cloud_covers(cloud, false, NULL), 0);
        assert_int_equal(fs_scene_write(&a, dir, NULL), 0);
    }
    fs_cloud_free(&a.cloud[LAYER_T_N]);
    assert_int_equal(fs_cloud_new(&a.cloud[LAYER_T_N], 2, 3, 0, NULL), 0); // no gains
    assert_int_equal(fs_scene_write(&a, dir, NULL), FS_ERR_INPUT);
    assert_int_equal(fs_scene_read(&b, *state, NULL), FS_ERR_INPUT); // no model.json
    fs_scene_free(&a);
    free(dir);
}

static void test_veil_refused(void **state)
{
    char *dir = fs_file_path("%s/veil", (char *)*state), *light = fs_file_path("%s/veil.tif", dir);
    Image other = {0};
    Scene a, b;
    make_shared(&a);
    add_veil(&a);
    assert_int_equal(fs_scene_write(&a, dir, NULL), 0);
    refuse(dir, "\"veil_cell\": 0.0", "\"veil_cell\": -0.0");
    refuse(dir, "\"veil_cell\"", "\"veil_cell\": \"x\", \"other\"");
    refuse(dir, "\"veil_unit\"", "\"other\"");
    refuse(dir, "\"veil_distance\"", "\"other\"");
    refuse(dir, "\"veil_right\"", "\"other\"");
    refuse(dir, "\"veil_ambient\": [", "\"veil_ambient\": [-1, 0, 0], \"other\": [");
    refuse(dir, "\"linear\"", "\"none\""); // which the flash does not light
    for (int k = 0; k < 3; k++) {          // of three channels; dark; no picture
        assert_int_equal(fs_image_new(&other, 5, 4, k ? 1 : 3, NULL), 0);
        other.px[7] = k ? -0.1f : 0.1f;
        if (k < 2) assert_int_equal(fs_tiff_write_float(light, &other, NULL), 0);
        if (k == 2) assert_int_equal(fs_file_write(light, "II*", 3, NULL), 0);
        fs_image_free(&other);
        assert_int_equal(fs_scene_read(&b, dir, NULL), FS_ERR_INPUT);
    }
    assert_int_equal(remove(light), 0);
    assert_int_equal(fs_scene_read(&b, dir, NULL), FS_ERR_INPUT);
    a.veil.light.px[3] = NAN;
    assert_int_equal(fs_scene_write(&a, dir, NULL), FS_ERR_INPUT);
    fs_scene_free(&a);
    free(light);
    free(dir);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_round_trip), cmocka_unit_test(test_refused),
                                       cmocka_unit_test(test_lift), cmocka_unit_test(test_veil_refused)};
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}

// Every combination of the settings that say what is computed, on a capture so small that all of them train and render
// in seconds: each ends with finite clouds and with pictures, or with a reason. And every instruction set trains to
// about the same scene.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "../unit/temp_dir.h"
#include "image/image.h"
#include "model/scene.h"

typedef struct Pair {
    const char *name, *value;
} Pair;

static const char *const separations[] = {"full", "flashless", "linear", "none"};
static const char *const geometries[] = {"shared", "separate"};
static const char *const betas[] = {"pane", "cloud"};
static const char *const densifies[] = {"relocate", "fsgs", "none"};
static const char *const lightings[] = {"both", "flash", "noflash"};

#ifdef __SANITIZE_THREAD__ // slow, and threads meet in the same places whatever is separated and densified
enum { SEPARATIONS_TRIED = 1, DENSIFIES_TRIED = 1, LIGHTINGS_TRIED = 1 };
#else
enum { SEPARATIONS_TRIED = 4, DENSIFIES_TRIED = 3, LIGHTINGS_TRIED = 3 };
#endif

static char *dir, *out;

// The stage `run` in the project, with these settings (until a NULL) beside the usual ones.
static int run_stage(int (*run)(FsProject *, FsError *), const Pair *more, FsError *err)
{
    static const Pair usual[] = {{"init-count", "150"},   {"max-splats", "200"},  {"progress-every", "0"},
                                 {"long-edge", "48"},     {"threads", "3"},       {"checkpoint-every", "0"},
                                 {"force", "true"},       {"linearity", "0.001"}, {"beta-smooth", "0.1"},
                                 {"depth-smooth", "0.01"}};
    FsSettings *settings = fs_settings_new();
    FsProject *project = NULL;
    int rc;
    char *poses = fs_file_path("%s/scene/truth/sparse", dir);
    *err = (FsError){0};
    assert_int_equal(fs_settings_set(settings, "poses", poses, NULL), 0);
    for (size_t i = 0; i < sizeof usual / sizeof *usual; i++)
        assert_int_equal(fs_settings_set(settings, usual[i].name, usual[i].value, NULL), 0);
    for (; more && more->name; more++) assert_int_equal(fs_settings_set(settings, more->name, more->value, NULL), 0);
    assert_int_equal(fs_project_open(&project, out, settings, NULL, NULL), 0);
    rc = run(project, err);
    fs_project_close(project);
    fs_settings_free(settings);
    free(poses);
    assert_true(rc == 0 || (rc < 0 && err->code == rc && *err->message));
    return rc;
}

static int ingest(FsProject *project, FsError *err)
{
    char *photos = fs_file_path("%s/scene/capture/raw", dir);
    int rc = fs_ingest(project, photos, err);
    free(photos);
    return rc;
}

static int make_capture(void **state)
{
    FsError err;
    FsSettings *settings = fs_settings_new();
    static const Pair small[] = {
        {"photos", "8"}, {"held-out", "1"}, {"width", "240"}, {"height", "160"}, {"seed", "5"}};
    for (size_t i = 0; i < sizeof small / sizeof *small; i++)
        fs_settings_set(settings, small[i].name, small[i].value, NULL);
    if (access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 0); // no waiting for a disk
    if (temp_dir_make(state) < 0) return -1;
    dir = *state;
    out = fs_file_path("%s/out", dir);
    char *scene = fs_file_path("%s/scene", dir);
    int rc = fs_synth(scene, settings, NULL, &err);
    free(scene);
    fs_settings_free(settings);
    if (rc == 0) rc = run_stage(ingest, NULL, &err);
    if (rc == 0) rc = run_stage(fs_poses, NULL, &err);
    if (rc < 0) print_message("%s\n", err.message);
    return rc;
}

static int drop_capture(void **state)
{
    free(out);
    return temp_dir_remove(state);
}

// Everything in OUT/clouds is read again (which checks that it is finite), and every layer has a picture.
static void check_results(const char *what)
{
    Scene scene = {0};
    FsError err = {0};
    FileList list = {0};
    char *clouds = fs_file_path("%s/clouds", out), *renders = fs_file_path("%s/renders/I_N", out);
    if (fs_scene_read(&scene, clouds, &err) < 0) fail_msg("%s: %s", what, err.message);
    assert_true(scene.cloud[LAYER_T_N].n > 0);
    if (fs_file_list(renders, &list, &err) < 0 || list.n == 0) fail_msg("%s: nothing was rendered", what);
    fs_file_list_free(&list);
    fs_scene_free(&scene);
    free(clouds);
    free(renders);
}

// True when the combination makes sense; a refusal of one that does is a failure.
static bool try_combination(const Pair *pairs, bool must)
{
    char what[200] = "";
    FsError err;
    for (const Pair *p = pairs; p->name; p++)
        snprintf(what + strlen(what), sizeof what - strlen(what), "--%s %s ", p->name, p->value);
    fprintf(stderr, "%s\n", what); // the last line before a crash
    int rc = run_stage(fs_train, pairs, &err);
    if (rc == 0) rc = run_stage(fs_render, pairs, &err);
    if (rc == 0)
        check_results(what);
    else if (must)
        fail_msg("%s: %s", what, err.message);
    return rc == 0;
}

// All densifications and lightings from one start.
static void try_start(const char *separation, const char *geometry, const char *beta, int *taken, int *refused)
{
    FsError err;
    // only the full separation is promised for every kind of scene
    bool must = strcmp(separation, "full") == 0 || (strcmp(geometry, "shared") == 0 && strcmp(beta, "pane") == 0);
    Pair pairs[] = {{"separation", separation},
                    {"geometry", geometry},
                    {"beta", beta},
                    {NULL, NULL},
                    {NULL, NULL},
                    {NULL, NULL},
                    {NULL, NULL}};
    int rc = run_stage(fs_initialise, pairs, &err);
    if (rc < 0 && must) fail_msg("%s, %s, %s: %s", separation, geometry, beta, err.message);
    for (int d = 0; d < DENSIFIES_TRIED; d++)
        for (int l = 0; l < LIGHTINGS_TRIED; l++) {
            pairs[3] = (Pair){"densify", densifies[d]};
            pairs[4] = (Pair){"lighting", lightings[l]};
            // past the first relocation (step 100), and the first cloning (step 500)
            pairs[5] = (Pair){"steps", d == 1 && l == 0 ? "510" : "130"};
            if (rc == 0 && try_combination(pairs, must))
                (*taken)++;
            else
                (*refused)++;
        }
}

static void test_every_combination(void **state)
{
    (void)state;
    int taken = 0, refused = 0;
    for (int s = 0; s < SEPARATIONS_TRIED; s++)
        for (int g = 0; g < 2; g++)
            for (int b = 0; b < 2; b++) try_start(separations[s], geometries[g], betas[b], &taken, &refused);
    print_message("%d combinations trained and rendered, %d refused with a reason\n", taken, refused);
    assert_int_equal(taken + refused, SEPARATIONS_TRIED * 2 * 2 * DENSIFIES_TRIED * LIGHTINGS_TRIED);
}

// Each way to part the points makes a start of its own, that trains; one depth parts those of a given cloud, too.
static void test_every_flash_cue(void **state)
{
    (void)state;
    static const char *const cues[] = {"contrast", "depth", "none"};
    char *first = fs_file_path("%s/start/T_N.ply", out), *points = fs_file_path("%s/points.ply", dir);
    char *was = NULL;
    size_t n = 0;
    FsError err;
    for (int c = 0; c < 3; c++) {
        const Pair pairs[] = {{"flash-cue", cues[c]}, {"steps", "20"}, {NULL, NULL}};
        if (run_stage(fs_initialise, pairs, &err) < 0) fail_msg("--flash-cue %s: %s", cues[c], err.message);
        char *now;
        size_t m;
        assert_int_equal(fs_file_read(first, 1 << 24, &now, &m, &err), 0);
        assert_true(!was || n != m || memcmp(was, now, n) != 0);
        free(was);
        was = now;
        n = m;
        assert_true(try_combination(pairs + 1, true));
        if (c > 0) continue;
        char *ply, *from = fs_file_path("%s/start/transmitted_surface.ply", out);
        assert_int_equal(fs_file_read(from, 1 << 24, &ply, &m, &err), 0);
        assert_int_equal(fs_file_write(points, ply, m, &err), 0);
        free(from);
        free(ply);
    }
    free(was);
    const Pair given[] = {{"flash-cue", "depth"}, {"points", points}, {NULL, NULL}};
    assert_int_equal(run_stage(fs_initialise, given, &err), 0);
    free(first);
    free(points);
}

// Both rows of a sheet have one exposure: what the flash lights is brighter in the second.
static void test_progress_sheet(void **state)
{
    (void)state;
    const Pair pairs[] = {{"steps", "20"}, {"progress-every", "20"}, {NULL, NULL}};
    FsError err;
    Image sheet = {0};
    double row[2] = {0, 0};
    char *path = fs_file_path("%s/progress/00020.png", out);
    assert_int_equal(run_stage(fs_initialise, NULL, &err), 0);
    assert_int_equal(run_stage(fs_train, pairs, &err), 0);
    assert_int_equal(fs_png_read(path, &sheet, &err), 0);
    for (int y = 0; y < sheet.height; y++)
        for (int i = 0; i < sheet.width * sheet.channels * 3 / 5; i++) // photo, composite and T
            row[2 * y >= sheet.height] +=
                (double)sheet.px[(size_t)y * (size_t)(sheet.width * sheet.channels) + (size_t)i];
    assert_true(row[1] > 1.1 * row[0]);
    fs_image_free(&sheet);
    free(path);
}

static void test_every_instruction_set(void **state)
{
    (void)state;
    static const char *const sets[] = {"scalar", "avx2", "avx512", "neon"};
    static const char *const layers[] = {"T_N", "T_F", "R", "I_N", "I_F"};
    Image first[5] = {0};
    FsError err;
    int trained = 0;
    Pair pairs[] = {{"cpu", "scalar"}, {"steps", "130"}, {NULL, NULL}};
    assert_int_equal(run_stage(fs_initialise, pairs, &err), 0);
    for (int s = 0; s < 4; s++) {
        pairs[0].value = sets[s];
        if (run_stage(fs_train, pairs, &err) < 0) { // this machine has it not
            assert_non_null(strstr(err.message, sets[s]));
            assert_int_not_equal(s, 0);
            continue;
        }
        assert_int_equal(run_stage(fs_render, pairs, &err), 0);
        for (int l = 0; l < 5; l++) {
            Image image = {0};
            double sum = 0;
            char *path = fs_file_path("%s/renders/%s/IMG_0001.png", out, layers[l]);
            assert_int_equal(fs_png_read(path, s ? &image : &first[l], &err), 0);
            free(path);
            int n = first[l].width * first[l].height * first[l].channels;
            for (int i = 0; s && i < n; i++) sum += pow(image.px[i] - first[l].px[i], 2);
            if (s) print_message("%s, %s: %.1f dB from scalar\n", sets[s], layers[l], -10 * log10(sum / n + 1e-12));
            assert_true(-10 * log10(sum / n + 1e-12) > 35);
            fs_image_free(&image);
        }
        trained++;
    }
    for (int l = 0; l < 5; l++) fs_image_free(&first[l]);
    print_message("%d instruction sets\n", trained);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_instruction_set),
        cmocka_unit_test(test_every_flash_cue),
        cmocka_unit_test(test_progress_sheet),
        cmocka_unit_test(test_every_combination),
    };
    return cmocka_run_group_tests(tests, make_capture, drop_capture);
}

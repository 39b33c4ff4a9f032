// Done marks: what makes a stage done, what makes it be done again, and what a rerun takes with it.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/cpu.h"
#include "base/file.h"
#include "model/project.h"
#include "temp_dir.h"

typedef struct Fixture {
    char *out;
    FsSettings *settings;
    FsProject *project;
    char last_log[2000];
} Fixture;

static void remember(void *user, FsLogLevel level, const char *message)
{
    (void)level;
    snprintf(((Fixture *)user)->last_log, sizeof((Fixture *)user)->last_log, "%s", message);
}

static void reopen(Fixture *f)
{
    FsError err = {0};
    fs_project_close(f->project);
    assert_int_equal(
        fs_project_open(&f->project, f->out, f->settings, &(FsCallbacks){.log = remember, .user = f}, &err), 0);
}

static void set(Fixture *f, const char *name, const char *value)
{
    assert_int_equal(fs_settings_set(f->settings, name, value, NULL), 0);
    reopen(f);
}

static int setup(void **state)
{
    Fixture *f = calloc(1, sizeof *f);
    void *dir;
    if (!f || temp_dir_make(&dir) < 0) return -1;
    f->out = dir;
    f->settings = fs_settings_new();
    if (fs_file_mkdirs(fs_file_at("%s/clouds", f->out).text, NULL) < 0) return -1; // what training leaves
    reopen(f);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    Fixture *f = *state;
    fs_project_close(f->project);
    fs_settings_free(f->settings);
    void *dir = f->out;
    temp_dir_remove(&dir);
    free(f);
    return 0;
}

static void mark(Fixture *f, unsigned stage)
{
    FsError err = {0};
    assert_int_equal(fs_project_mark_done(f->project, stage, &err), 0);
}

static void test_mark_and_skip(void **state)
{
    Fixture *f = *state;
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    mark(f, FS_STAGE_TRAIN);
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_non_null(strstr(f->last_log, "skipped"));
    set(f, "force", "true");
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
}

static void test_another_version_is_said(void **state)
{
    Fixture *f = *state;
    FilePath path = fs_file_at("%s/done/train.json", f->out);
    char *text;
    size_t size;
    mark(f, FS_STAGE_TRAIN);
    assert_int_equal(fs_file_read(path.text, 1 << 20, &text, &size, NULL), 0);
    char *at = strstr(text, fs_version());
    assert_non_null(at);
    *at = '7';
    assert_int_equal(fs_file_write(path.text, text, size, NULL), 0);
    free(text);
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_non_null(strstr(f->last_log, "train: done already by version 7"));
    assert_non_null(strstr(f->last_log, fs_version()));
}

static void test_changed_setting_is_named(void **state)
{
    Fixture *f = *state;
    mark(f, FS_STAGE_TRAIN);
    set(f, "steps", "77");
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_non_null(strstr(f->last_log, "the setting steps was"));
    assert_non_null(strstr(f->last_log, "77"));
}

static void test_settings_that_do_not_change_results(void **state)
{
    Fixture *f = *state;
    mark(f, FS_STAGE_TRAIN);
    set(f, "threads", "1");
    set(f, "checkpoint-every", "3");
    set(f, "progress-every", "3");
    set(f, "resume", "true");
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    mark(f, FS_STAGE_INGEST);
    set(f, "steps", "78"); // not a setting of ingest
    assert_true(fs_project_done(f->project, FS_STAGE_INGEST));
}

static void test_rerun_takes_later_marks(void **state)
{
    Fixture *f = *state;
    mark(f, FS_STAGE_INGEST);
    mark(f, FS_STAGE_TRAIN);
    mark(f, FS_STAGE_RENDER);
    mark(f, FS_STAGE_EXPORT);
    fs_project_unmark(f->project, FS_STAGE_RENDER); // export does not read renders
    assert_false(fs_project_done(f->project, FS_STAGE_RENDER));
    char *dir = fs_file_path("%s/export", f->out);
    assert_false(fs_project_done(f->project, FS_STAGE_EXPORT)); // what it wrote is gone
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_true(fs_project_done(f->project, FS_STAGE_EXPORT));
    free(dir);
    fs_project_unmark(f->project, FS_STAGE_TRAIN);
    assert_true(fs_project_done(f->project, FS_STAGE_INGEST));
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_false(fs_project_done(f->project, FS_STAGE_EXPORT));
}

// What a training left that ended while it wrote its first checkpoint.
static void test_a_torn_checkpoint_goes(void **state)
{
    Fixture *f = *state;
    FsError err = {0};
    char *dir = fs_file_path("%s/checkpoint.new", f->out), *file = fs_file_path("%s/T_N.ply", dir);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_file_write(file, "1", 1, NULL), 0);
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_TRAIN, (const char *const[]){"a"}, 1, &err), 0);
    assert_false(fs_file_exists(file));
    assert_false(fs_file_exists(dir));
    free(file);
    free(dir);
}

// What poses or the start left of other photos is not gone on from.
static void test_stale_results(void **state)
{
    Fixture *f = *state;
    FsError err = {0};
    FilePath start = fs_file_at("%s/start", f->out), model = fs_file_at("%s/start/model.json", f->out);
    assert_int_equal(fs_file_mkdirs(start.text, NULL) | fs_file_write(model.text, "{}", 2, NULL), 0);
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_TRAIN, NULL, 0, &err), 0); // somebody's own
    mark(f, FS_STAGE_INGEST);
    mark(f, FS_STAGE_POSES);
    mark(f, FS_STAGE_INITIALISE);
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_TRAIN, NULL, 0, &err), 0);
    fs_project_unmark(f->project, FS_STAGE_POSES);
    mark(f, FS_STAGE_POSES);
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_TRAIN, NULL, 0, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "initialise was not done since poses was: first run `flashsplat initialise"));
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_EXPORT, NULL, 0, &err), FS_ERR_INPUT);
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_INITIALISE, NULL, 0, &err), 0);
}

static void test_broken_marks(void **state)
{
    Fixture *f = *state;
    static const char *const texts[] = {"", "{", "[1, 2]", "{\"settings\": 3}", "\xff\xfe", "{\"settings\": {}}"};
    mark(f, FS_STAGE_TRAIN);
    char *path = fs_file_path("%s/done/train.json", f->out);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        assert_int_equal(fs_file_write(path, texts[i], strlen(texts[i]), NULL), 0);
        assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    }
    free(path);
}

static void write_file(Fixture *f, const char *name, const char *text)
{
    char *path = fs_file_path("%s/%s", f->out, name), *dir = fs_file_path("%s/images", f->out);
    assert_int_equal(fs_file_mkdirs(dir, NULL), 0);
    assert_int_equal(fs_file_write(path, text, strlen(text), NULL), 0);
    free(path);
    free(dir);
}

static void test_changed_inputs_are_named(void **state)
{
    Fixture *f = *state;
    write_file(f, "views.json", "1");
    write_file(f, "images/a.tif", "1");
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    mark(f, FS_STAGE_TRAIN);
    write_file(f, "images/Thumbs.db", "what a file manager leaves");
    write_file(f, "images/a.tif", "1"); // the same again
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    write_file(f, "images/a.tif", "2");
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_non_null(strstr(f->last_log, "images changed"));
    mark(f, FS_STAGE_TRAIN);
    write_file(f, "images/b.tif", "2");
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    mark(f, FS_STAGE_TRAIN);
    write_file(f, "views.json", "2"); // while the stage works: its results are of what was there before
    mark(f, FS_STAGE_TRAIN);
    assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_non_null(strstr(f->last_log, "views.json changed"));
    mark(f, FS_STAGE_TRAIN);
    char *images = fs_file_path("%s/images", f->out);
    fs_file_remove_tree(images); // to save room
    free(images);
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    assert_false(fs_project_done(f->project, FS_STAGE_INITIALISE));
}

static void test_photos_and_models(void **state)
{
    Fixture *f = *state;
    char *model = fs_file_path("%s/model.json", f->out);
    write_file(f, "model.json", "1");
    set(f, "poses", model);
    assert_false(fs_project_done(f->project, FS_STAGE_POSES));
    mark(f, FS_STAGE_POSES);
    assert_true(fs_project_done(f->project, FS_STAGE_POSES));
    write_file(f, "model.json", "2");
    assert_false(fs_project_done(f->project, FS_STAGE_POSES));
    assert_non_null(strstr(f->last_log, "the model of --poses changed"));
    strcpy(f->project->photos, "1");
    assert_false(fs_project_done(f->project, FS_STAGE_INGEST));
    mark(f, FS_STAGE_INGEST);
    *f->project->photos = 0; // gone
    assert_true(fs_project_done(f->project, FS_STAGE_INGEST));
    strcpy(f->project->photos, "2");
    assert_false(fs_project_done(f->project, FS_STAGE_INGEST));
    free(model);
}

// A checkpoint's side: what is stored beside the work is refused once it is not what would be stored now.
static void test_fingerprint_is_checked(void **state)
{
    Fixture *f = *state;
    FsError err = {0};
    char *was = strdup(fs_project_fingerprint(f->project, FS_STAGE_TRAIN));
    assert_int_equal(fs_project_check(f->project, FS_STAGE_TRAIN, was, "checkpoint", &err), 0);
    set(f, "gain-push", "0.5");
    assert_int_equal(fs_project_check(f->project, FS_STAGE_TRAIN, was, "checkpoint", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "checkpoint: the setting gain-push was 0.02 and is 0.5 now"));
    static const char *const odd[] = {NULL, "", "{}", "[]", "{\"settings\": {}, \"inputs\": 1}"};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++)
        assert_int_equal(fs_project_check(f->project, FS_STAGE_TRAIN, odd[i], "checkpoint", &err), FS_ERR_INPUT);
    free(was);
}

static void test_the_instruction_set_used_counts(void **state)
{
    Fixture *f = *state;
    mark(f, FS_STAGE_TRAIN);
    set(f, "cpu", fs_cpu_name(fs_cpu_best())); // what "best" is here
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    set(f, "cpu", "scalar");
    if (fs_cpu_best() != CPU_SCALAR) assert_false(fs_project_done(f->project, FS_STAGE_TRAIN));
}

static void test_warnings_are_kept_until_their_stage_runs_again(void **state)
{
    Fixture *f = *state;
    assert_null(fs_warnings_read(f->out));
    fs_log_warn(&f->project->log, "nobody's");
    fs_warnings_stage(f->project->warnings, "train");
    fs_log_warn(&f->project->log, "dark\nphotos");
    fs_warnings_stage(f->project->warnings, "ingest");
    fs_log_warn(&f->project->log, "a photo is bad");
    fs_log_warn(&f->project->log, "a photo is ba");
    fs_log_warn(&f->project->log, "a photo is bad");
    fs_log_info(&f->project->log, "no warning");
    assert_string_equal(f->last_log, "no warning"); // all go on to the caller
    reopen(f);
    char *text = fs_warnings_read(f->out);
    assert_string_equal(text, "a photo is bad\na photo is ba\ndark photos\n");
    free(text);
    fs_warnings_stage(f->project->warnings, "ingest");
    assert_false(fs_project_done(f->project, FS_STAGE_INGEST));
    fs_log_warn(&f->project->log, "of a stage that did not begin");
    fs_warnings_stage(f->project->warnings, "ingest");
    text = fs_warnings_read(f->out);
    assert_string_equal(text, "a photo is bad\na photo is ba\ndark photos\n");
    free(text);
    assert_false(fs_project_done(f->project, FS_STAGE_INGEST));
    fs_log_warn(&f->project->log, "another");
    assert_int_equal(fs_project_begin(f->project, FS_STAGE_INGEST, NULL, 0, NULL), 0);
    fs_log_warn(&f->project->log, "one more");
    text = fs_warnings_read(f->out);
    assert_string_equal(text, "another\none more\ndark photos\n");
    free(text);
    mark(f, FS_STAGE_TRAIN);
    assert_true(fs_project_done(f->project, FS_STAGE_TRAIN));
    fs_warnings_stage(f->project->warnings, "train");
    for (int i = 0; i < 5000; i++) fs_log_warn(&f->project->log, "warning number %d, which grows without an end", i);
    text = fs_warnings_read(f->out);
    assert_true(strlen(text) > 30000 && strlen(text) <= 65536 + 100);
    free(text);
}

static void test_open_refuses(void **state)
{
    Fixture *f = *state;
    FsError err = {0};
    FsProject *project;
    assert_int_equal(fs_project_open(&project, "", f->settings, NULL, &err), FS_ERR_USAGE);
    assert_null(project);
    assert_int_equal(fs_synth("", f->settings, NULL, NULL), FS_ERR_USAGE); // not into the root
    assert_int_equal(fs_pair("a", "", "b", f->settings, NULL, NULL), FS_ERR_USAGE);
    assert_int_equal(fs_check(NULL, f->settings, NULL, NULL), FS_ERR_USAGE);
    assert_int_equal(fs_run(f->project, "", &err), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "photos"));
    char *file = fs_file_path("%s/file", f->out);
    assert_int_equal(fs_file_write(file, "x", 1, NULL), 0);
    assert_int_equal(fs_project_open(&project, file, f->settings, NULL, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, file));
    free(file);
}

static void test_a_folder_is_of_one_program(void **state)
{
    Fixture *f = *state;
    FsError err = {0};
    FsProject *other;
    assert_int_equal(fs_project_open(&other, f->out, f->settings, NULL, &err), 0);
    assert_int_equal(fs_project_lock(f->project, &err), 0);
    assert_int_equal(fs_train(other, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, f->out));
    assert_non_null(strstr(err.message, "another flashsplat"));
    assert_int_equal(fs_run(other, "nosuch", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "another flashsplat"));
    assert_int_equal(fs_project_lock(f->project, &err), 0);
    fs_project_close(f->project);
    f->project = NULL;
    assert_int_equal(fs_project_lock(other, &err), 0);
    fs_project_close(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_mark_and_skip, setup, teardown),
        cmocka_unit_test_setup_teardown(test_another_version_is_said, setup, teardown),
        cmocka_unit_test_setup_teardown(test_changed_setting_is_named, setup, teardown),
        cmocka_unit_test_setup_teardown(test_settings_that_do_not_change_results, setup, teardown),
        cmocka_unit_test_setup_teardown(test_rerun_takes_later_marks, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_torn_checkpoint_goes, setup, teardown),
        cmocka_unit_test_setup_teardown(test_stale_results, setup, teardown),
        cmocka_unit_test_setup_teardown(test_broken_marks, setup, teardown),
        cmocka_unit_test_setup_teardown(test_changed_inputs_are_named, setup, teardown),
        cmocka_unit_test_setup_teardown(test_photos_and_models, setup, teardown),
        cmocka_unit_test_setup_teardown(test_fingerprint_is_checked, setup, teardown),
        cmocka_unit_test_setup_teardown(test_the_instruction_set_used_counts, setup, teardown),
        cmocka_unit_test_setup_teardown(test_warnings_are_kept_until_their_stage_runs_again, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_folder_is_of_one_program, setup, teardown),
        cmocka_unit_test_setup_teardown(test_open_refuses, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

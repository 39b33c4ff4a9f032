// Whose files: what is written down is ours while it is as it was written; all else stays.
#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/hash.h"
#include "base/owned.h"
#include "base/threads.h"
#include "temp_dir.h"

static char *in(void **state, const char *name)
{
    static char path[8][600];
    static int k;
    k = (k + 1) % 8;
    snprintf(path[k], sizeof path[k], "%s/%s", (char *)*state, name);
    return path[k];
}

static void put(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

static void ours(const char *path, const char *text)
{
    assert_int_equal(fs_file_write(path, text, strlen(text), NULL), 0);
}

static int make(void **state)
{
    return temp_dir_make(state) < 0 || fs_owned_open(*state, "project", NULL) < 0 ? -1 : 0;
}

static void test_only_what_is_ours_goes(void **state)
{
    FsError err = {0};
    assert_int_equal(fs_file_mkdirs(in(state, "a/b"), NULL), 0);
    ours(in(state, "a/b/ours"), "1");
    ours(in(state, "a/edited"), "1");
    ours(in(state, "a/odd \\ name\nof two lines"), "1");
    put(in(state, "a/edited"), "2");
    put(in(state, "a/theirs"), "1");
    assert_int_equal(fs_owned_check(in(state, "a/b/ours"), &err), 0);
    assert_int_equal(fs_owned_check(in(state, "a/nothing"), &err), 0);
    assert_int_equal(fs_owned_check(in(state, "a//./b/ours"), &err), 0);
    assert_int_equal(fs_owned_check(in(state, "a/edited"), &err), FS_ERR_INPUT);
    assert_int_equal(fs_owned_check(in(state, "a/theirs"), &err), FS_ERR_INPUT);
    assert_int_equal(fs_owned_check(in(state, "a/b"), &err), FS_ERR_INPUT); // a folder
    assert_int_equal(fs_owned_check_tree(in(state, "a/b"), &err), 0);
    assert_int_equal(fs_owned_check_tree(in(state, "a"), &err), FS_ERR_INPUT);
    assert_int_equal(fs_file_write(in(state, "a/theirs"), "3", 1, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "a/theirs: is in the way"));
    assert_int_equal(fs_file_link(in(state, "a/b/ours"), in(state, "a/theirs"), &err), FS_ERR_INPUT);
    assert_int_equal(fs_file_append(in(state, "a/theirs"), "3", &err), FS_ERR_INPUT);
    put(in(state, "a/edited"), "1"); // as it was
    fs_owned_remove(in(state, "a"));
    assert_false(fs_file_exists(in(state, "a/b")));
    assert_false(fs_file_exists(in(state, "a/edited")));
    assert_false(fs_file_exists(in(state, "a/odd \\ name\nof two lines")));
    char *text;
    size_t size;
    assert_int_equal(fs_file_read(in(state, "a/theirs"), 10, &text, &size, NULL), 0);
    assert_string_equal(text, "1");
    free(text);
}

// Files elsewhere tell by themselves; a copy, an edited one, one that was replaced, a link are the user's.
static void test_outside(void **state)
{
    char *file = in(state, "a.json"), *other = in(state, "b.json");
    put(file, "1");
    assert_int_equal(fs_owned_check(file, NULL), FS_ERR_INPUT);
    unlink(file);
    ours(file, "1");
    bool marks = lgetxattr(file, "user.flashsplat", NULL, 0) > 0;
    if (marks) {
        assert_int_equal(fs_owned_check(file, NULL), 0);
        ours(file, "2");
        assert_int_equal(fs_owned_check(file, NULL), 0);
        assert_int_equal(symlink(file, other), 0);
        assert_int_equal(fs_owned_check(other, NULL), FS_ERR_INPUT);
        unlink(other);
    }
    put(file, "3"); // keeps the attribute
    assert_int_equal(fs_owned_check(file, NULL), FS_ERR_INPUT);
    unlink(file);
    put(file, "2");
    assert_int_equal(fs_owned_check(file, NULL), FS_ERR_INPUT);
    unlink(file);
    if (!marks) skip(); // a disk without extended attributes
}

static void test_names_that_begin_alike(void **state)
{
    ours(in(state, "views"), "1");
    ours(in(state, "views.json"), "1");
    fs_owned_remove(in(state, "views"));
    assert_false(fs_file_exists(in(state, "views")));
    assert_true(fs_file_exists(in(state, "views.json")));
    ours(in(state, "views.json"), "2");
    put(in(state, "views.json"), "1"); // what was written once is ours still: a rename may have failed
    assert_int_equal(fs_owned_check(in(state, "views.json"), NULL), 0);
}

static void test_swapped_folders(void **state)
{
    for (int i = 0; i < 4; i++) { // as checkpoints do
        char text[2] = {(char)('0' + i), 0};
        assert_int_equal(fs_file_mkdirs(in(state, "checkpoint.new"), NULL), 0);
        ours(in(state, "checkpoint.new/same"), "1");
        ours(in(state, "checkpoint.new/other"), text);
        if (i) assert_int_equal(fs_file_rename(in(state, "checkpoint"), in(state, "checkpoint.old"), NULL), 0);
        assert_int_equal(fs_file_rename(in(state, "checkpoint.new"), in(state, "checkpoint"), NULL), 0);
        assert_int_equal(fs_owned_check_tree(in(state, "checkpoint"), NULL), 0);
        fs_owned_remove(in(state, "checkpoint.old"));
        assert_false(fs_file_exists(in(state, "checkpoint.old")));
        assert_int_equal(fs_owned_check(in(state, "checkpoint/same"), NULL), 0);
    }
    fs_owned_remove(in(state, "checkpoint"));
    assert_false(fs_file_exists(in(state, "checkpoint")));
}

// Files written and removed by many threads, as render does: what is there afterwards is still ours.
static void write_and_remove(void *context, int job, int worker)
{
    (void)worker;
    FilePath gone = fs_file_at("%s/gone%d", (const char *)context, job),
             stays = fs_file_at("%s/stays%d", (const char *)context, job);
    if (fs_file_write(gone.text, "1", 1, NULL) == 0 && fs_file_write(stays.text, "2", 1, NULL) == 0)
        fs_owned_remove(gone.text);
}

static void test_many_threads(void **state)
{
    enum { FILES = 60 };
    Threads *threads = fs_threads_new(8);
    fs_threads_for(threads, FILES, write_and_remove, *state);
    fs_threads_free(threads);
    for (int i = 0; i < FILES; i++) {
        FilePath gone = fs_file_at("%s/gone%d", (char *)*state, i), stays = fs_file_at("%s/stays%d", (char *)*state, i);
        assert_false(fs_file_exists(gone.text));
        assert_true(fs_file_exists(stays.text));
        assert_int_equal(fs_owned_check(stays.text, NULL), 0);
    }
}

static void test_unused_mark_goes(void **state)
{
    Lock lock = {0}, other = {0};
    fs_owned_leave(*state, 0, &lock);
    fs_lock_release(&lock);
    assert_false(fs_file_exists(in(state, FS_OWNED_DIR)));
    assert_true(fs_owned_lock(*state, &lock)); // nothing that could be locked
    assert_false(lock.held);
    assert_int_equal(fs_owned_open(*state, "project", NULL), 0);
    assert_true(fs_owned_lock(*state, &other));
    fs_owned_leave(*state, 0, &lock); // somebody else is about to write
    assert_true(fs_file_exists(in(state, FS_OWNED_DIR "/made")));
    fs_lock_release(&other);
    fs_owned_leave(*state, 0, &lock);
    assert_false(fs_file_exists(in(state, FS_OWNED_DIR)));
    fs_lock_release(&lock);
    assert_int_equal(fs_owned_open(*state, "project", NULL), 0);
    ours(in(state, "a"), "1");
    fs_owned_leave(*state, strlen(*state), &lock);
    assert_int_equal(fs_owned_check(in(state, "a"), NULL), 0);
    fs_lock_release(&lock);
    fs_owned_remove(in(state, "."));
    fs_owned_leave(*state, strlen(*state), &lock);
    assert_false(fs_file_exists(*state));
    fs_lock_release(&lock);
}

static void test_one_program_at_a_time(void **state)
{
    Lock lock = {0}, other = {0};
    assert_true(fs_owned_lock(*state, &lock) && fs_owned_lock(*state, &lock));
    assert_true(lock.held);
    assert_false(fs_owned_lock(*state, &other));
    fs_lock_release(&lock);
    assert_true(fs_owned_lock(*state, &other));
    assert_int_equal(unlink(in(state, FS_OWNED_DIR "/made")), 0); // a crash on the way out
    assert_true(fs_owned_lock(*state, &lock));
    assert_int_equal(fs_owned_open(*state, "project", NULL), 0);
    assert_false(fs_owned_lock(*state, &lock));
    fs_lock_release(&other);
    assert_int_equal(unlink(in(state, FS_OWNED_DIR "/lock")) | mkdir(in(state, FS_OWNED_DIR "/lock"), 0777), 0);
    assert_true(fs_owned_lock(*state, &lock)); // none can be had: without
    assert_false(lock.held);
}

static void test_links(void **state)
{
    FsError err = {0};
    assert_int_equal(fs_file_mkdirs(in(state, "a"), NULL) | mkdir(in(state, "theirs"), 0777), 0);
    ours(in(state, "a/file"), "1");
    put(in(state, "theirs/file"), "1"); // the same bytes
    put(in(state, "theirs/other"), "1");
    assert_int_equal(rename(in(state, "a"), in(state, "moved")) | symlink("theirs", in(state, "a")), 0);
    assert_int_equal(fs_owned_check(in(state, "a/new"), &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "/a: is a link"));
    assert_int_equal(fs_file_write(in(state, "a/new"), "1", 1, &err), FS_ERR_INPUT);
    fs_owned_remove(in(state, "a"));
    fs_owned_remove(in(state, "a/file"));
    assert_true(fs_file_exists(in(state, "theirs/file")));
    assert_int_equal(unlink(in(state, "a")), 0);
    ours(in(state, "file"), "1");
    assert_int_equal(unlink(in(state, "file")) | symlink("theirs/other", in(state, "file")), 0);
    assert_int_equal(fs_owned_check(in(state, "file"), &err), FS_ERR_INPUT);
    fs_owned_remove(in(state, "file"));
    struct stat st;
    assert_int_equal(lstat(in(state, "file"), &st), 0);
}

static void test_kinds_of_folders(void **state)
{
    FsError err = {0};
    assert_int_equal(fs_owned_open(*state, "project", &err), 0);
    assert_int_equal(fs_owned_open(*state, "capture", &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "belongs to a project"));
    assert_int_equal(fs_owned_open(in(state, "capture"), "capture", &err), 0); // in a project, a folder of its own
    assert_int_equal(fs_owned_open(in(state, "capture"), "renders", &err), FS_ERR_INPUT);
    assert_int_equal(fs_owned_open(in(state, "capture/T"), "renders", &err), FS_ERR_INPUT);
    assert_int_equal(fs_owned_open(in(state, "more"), "renders", &err), 0);
    assert_false(fs_file_exists(in(state, "more/" FS_OWNED_DIR)));
    assert_int_equal(fs_file_mkdirs(in(state, "foreign/" FS_OWNED_DIR), NULL), 0);
    put(in(state, "foreign/" FS_OWNED_DIR "/made.part7-0"), "");
    put(in(state, "foreign/" FS_OWNED_DIR "/7-notes"), "");
    assert_int_equal(fs_owned_open(in(state, "foreign"), "project", &err), FS_ERR_INPUT);
    assert_int_equal(unlink(in(state, "foreign/" FS_OWNED_DIR "/7-notes")), 0);
    assert_int_equal(fs_owned_open(in(state, "foreign"), "project", &err), 0);
    assert_int_equal(mkdir(in(state, "linked"), 0777) | symlink("..", in(state, "linked/" FS_OWNED_DIR)), 0);
    assert_int_equal(fs_owned_open(in(state, "linked"), "project", &err), FS_ERR_INPUT);
    put(in(state, "plain"), "");
    assert_int_equal(fs_owned_open(in(state, "plain"), "project", &err), FS_ERR_IO);
}

// Lists that were cut short or spoilt make files the user's; nothing worse.
static void test_damaged_lists(void **state)
{
    char *text;
    size_t size;
    ours(in(state, "file"), "1");
    assert_int_equal(fs_file_read(in(state, FS_OWNED_DIR "/made"), 1000, &text, &size, NULL), 0);
    for (size_t n = 0; n <= size; n++) {
        FILE *f = fopen(in(state, FS_OWNED_DIR "/made"), "w");
        fwrite(text, 1, n, f);
        fclose(f);
        assert_int_equal(fs_owned_check(in(state, "file"), NULL) == 0, n == size);
        fs_owned_remove(in(state, "other"));
        ours(in(state, "late"), "1");
        assert_int_equal(fs_owned_check(in(state, "late"), NULL), 0); // a line after a torn one
        fs_owned_remove(in(state, "late"));
        assert_false(fs_file_exists(in(state, "late")));
        assert_true(fs_file_exists(in(state, "file")));
    }
    free(text);
}

// Nor does a list that somebody else wrote reach beyond its folder; zeros, which a crash may leave, hide nothing.
static void test_foreign_lists(void **state)
{
    static const char *const names[] = {"../beside", "a/../../beside", "\\.\\./beside"};
    char *dir = in(state, "project"), *beside = in(state, "beside"), *file = in(state, "project/file");
    char *made = in(state, "project/" FS_OWNED_DIR "/made"), *all = in(state, "project/.");
    uint64_t hash = FS_HASH_EMPTY, size;
    assert_int_equal(fs_owned_open(dir, "project", NULL), 0);
    assert_int_equal(fs_file_mkdirs(in(state, "project/a"), NULL), 0);
    put(beside, "1");
    assert_int_equal(fs_hash_file(beside, false, &hash, &size), 0);
    for (int i = 0; i < 3; i++) {
        FILE *f = fopen(made, "a");
        fprintf(f, "\n%016" PRIx64 " 1 %s\n", hash, names[i]);
        fwrite("\0\0", 1, 2, f);
        fclose(f);
        ours(file, "1");
        assert_int_equal(fs_owned_check(file, NULL), 0);
        fs_owned_remove(all);
        assert_false(fs_file_exists(file));
        assert_true(fs_file_exists(beside));
    }
}

static void test_files_in_the_making(void **state)
{
    AtomicFile file;
    assert_int_equal(fs_file_begin(&file, in(state, "file"), NULL), 0);
    assert_non_null(strstr(file.temp, "/" FS_OWNED_DIR "/"));
    fs_file_abort(&file);
    put(in(state, FS_OWNED_DIR "/999999999-3"), "of a process that is gone");
    Lock lock = {0};
    assert_true(fs_owned_lock(*state, &lock));
    fs_lock_release(&lock);
    assert_false(fs_file_exists(in(state, FS_OWNED_DIR "/999999999-3")));
    assert_int_equal(fs_file_append(in(state, "log"), "1\n", NULL) | fs_file_append(in(state, "log"), "2\n", NULL), 0);
    assert_int_equal(fs_owned_check(in(state, "log"), NULL), 0);
    assert_true(fs_owned_is_result(in(state, "log")));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_only_what_is_ours_goes, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_outside, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_names_that_begin_alike, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_swapped_folders, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_many_threads, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_unused_mark_goes, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_one_program_at_a_time, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_links, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_kinds_of_folders, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_damaged_lists, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_foreign_lists, make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_files_in_the_making, make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

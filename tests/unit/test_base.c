// Files that appear whole or not at all, programs that are run and stopped, jobs on threads, memory of a step.
#include <poll.h>
#include <sched.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/arena.h"
#include "base/cpu.h"
#include "base/process.h"
#include "base/rng.h"
#include "base/threads.h"
#include "temp_dir.h"

static char *in(void **state, const char *name)
{
    return fs_file_path("%s/%s", (char *)*state, name);
}

static void assert_holds(const char *path, const char *text)
{
    char *data;
    size_t size;
    FsError err = {0};
    if (fs_file_read(path, 1000, &data, &size, &err) < 0) fail_msg("%s", err.message);
    assert_string_equal(data, text);
    assert_int_equal(size, strlen(text));
    free(data);
}

static int count_files(void **state)
{
    FileList list;
    assert_int_equal(fs_file_list(*state, &list, NULL), 0);
    int n = list.n;
    fs_file_list_free(&list);
    return n;
}

static void test_write_is_whole_or_not(void **state)
{
    char *path = in(state, "a");
    assert_int_equal(fs_file_write(path, "old", 3, NULL), 0);
    AtomicFile file;
    assert_int_equal(fs_file_begin(&file, path, NULL), 0);
    fputs("new", file.f);
    assert_holds(path, "old");
    fs_file_abort(&file);
    assert_holds(path, "old");
    assert_int_equal(count_files(state), 1);
    assert_int_equal(fs_file_begin(&file, path, NULL), 0);
    fputs("new", file.f);
    assert_int_equal(fs_file_commit(&file, NULL), 0);
    assert_holds(path, "new");
    fs_file_abort(&file); // harmless after commit
    assert_int_equal(count_files(state), 1);
    free(path);
}

static void test_write_that_cannot_be(void **state)
{
    FsError err = {0};
    char *path = in(state, "none/a");
    assert_int_equal(fs_file_write(path, "x", 1, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, path));
    free(path);
    path = in(state, "folder");
    assert_int_equal(fs_file_mkdirs(path, NULL), 0);
    assert_int_equal(fs_file_write(path, "x", 1, &err), FS_ERR_IO); // a folder of that name
    assert_int_equal(rmdir(path), 0);
    free(path);
    assert_int_equal(count_files(state), 0); // no temporary file left
}

static void test_read_refuses(void **state)
{
    char *data;
    size_t size;
    FsError err = {0};
    char *path = in(state, "a");
    assert_int_equal(fs_file_read(path, 10, &data, &size, &err), FS_ERR_INPUT);
    fs_file_write(path, "0123456789", 10, NULL);
    assert_int_equal(fs_file_read(path, 9, &data, &size, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, path));
    assert_null(data);
    assert_int_equal(fs_file_read(*state, 10, &data, &size, &err), FS_ERR_INPUT); // a folder
    assert_int_equal(fs_file_read(path, 10, &data, &size, &err), 0);
    free(data);
    unlink(path);
    free(path);
}

static void test_folders_and_names(void **state)
{
    char *deep = in(state, "x/y//z/"), *top = in(state, "x"), *file = in(state, "x/file"),
         *below = in(state, "x/file/b");
    FsError err = {0};
    assert_int_equal(fs_file_mkdirs(deep, &err), 0);
    assert_int_equal(fs_file_mkdirs(deep, &err), 0);
    assert_true(fs_file_is_dir(deep));
    fs_file_write(file, "", 0, NULL);
    assert_int_equal(fs_file_mkdirs(file, &err), FS_ERR_IO);
    assert_int_equal(fs_file_mkdirs(below, &err), FS_ERR_IO);
    fs_file_remove_tree(top);
    assert_false(fs_file_exists(top));
    free(deep), free(top), free(file), free(below);
    static const char *const stems[][2] = {
        {"a/b.c/IMG_1.x.JPG", "IMG_1.x"}, {".hidden", ".hidden"}, {"plain", "plain"}};
    for (int i = 0; i < 3; i++) {
        char *stem = fs_file_stem(stems[i][0]);
        assert_string_equal(stem, stems[i][1]);
        free(stem);
    }
    assert_true(fs_file_has_ext("a/b.JPG", "jpg"));
    assert_false(fs_file_has_ext("a.jpg/b", "jpg"));
    assert_string_equal(fs_file_name("a/b/c"), "c");
}

static void test_list_is_sorted(void **state)
{
    static const char *const names[] = {"b", "a", ".hidden", "c10", "c9"};
    FileList list;
    char *dir = in(state, "list");
    fs_file_mkdirs(dir, NULL);
    for (int i = 0; i < 5; i++) {
        char *path = fs_file_path("%s/%s", dir, names[i]);
        fs_file_write(path, "", 0, NULL);
        free(path);
    }
    assert_int_equal(fs_file_list(dir, &list, NULL), 0);
    assert_int_equal(list.n, 4);
    assert_string_equal(list.name[0], "a");
    assert_string_equal(list.name[2], "c10");
    fs_file_list_free(&list);
    static const char *const pictures[] = {"900.png", "1000b.PNG", "1000a.png", "2000.jpg"};
    FilePath last;
    assert_false(fs_file_last(dir, "png", &last));
    for (int i = 0; i < 4; i++) fs_file_write(fs_file_at("%s/%s", dir, pictures[i]).text, "", 0, NULL);
    assert_true(fs_file_last(dir, "png", &last));
    assert_string_equal(last.text, fs_file_at("%s/1000b.PNG", dir).text);
    fs_file_remove_tree(dir);
    assert_int_equal(fs_file_list(dir, &list, NULL), FS_ERR_INPUT);
    assert_false(fs_file_last(dir, "png", &last));
    free(dir);
}

static bool yes(void *user)
{
    (void)user;
    return true;
}

static void test_process(void **state)
{
    FsError err = {0};
    char *log = in(state, "log");
    assert_int_equal(
        fs_process_run((const char *[]){"sh", "-c", "echo out; echo err >&2; exit 3", NULL}, log, NULL, &err), 3);
    assert_holds(log, "out\nerr\n");
    assert_int_equal(fs_process_run((const char *[]){"sh", "-c", "kill -9 $$", NULL}, log, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "signal 9"));
    assert_int_equal(fs_process_run((const char *[]){"flashsplat-no-such-program", NULL}, log, NULL, &err),
                     FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "flashsplat-no-such-program"));
    time_t begin = time(NULL);
    assert_int_equal(fs_process_run((const char *[]){"sleep", "60", NULL}, log, &(Log){.cancelled = yes}, &err),
                     FS_ERR_CANCELLED);
    const char *under_env[] = {"env", "A=1", "sleep", "60", NULL};
    assert_int_equal(fs_process_run(under_env, log, &(Log){.cancelled = yes}, &err), FS_ERR_CANCELLED);
    assert_string_equal(err.message, "stopped while sleep ran");
    assert_true(time(NULL) - begin < 30);
    assert_true(fs_process_found("sh"));
    assert_false(fs_process_found("flashsplat-no-such-program"));
    free(log);
}

// What is killed takes its program with it: the pipe ends when nobody holds it any more.
static void test_process_dies_with_us(void **state)
{
    char *log = in(state, "log"), command[64], c;
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    snprintf(command, sizeof command, "echo x >&%d; exec sleep 60", ends[1]);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        fs_process_run((const char *[]){"sh", "-c", command, NULL}, log, NULL, NULL);
        _exit(0);
    }
    close(ends[1]);
    assert_true(read(ends[0], &c, 1) == 1 && c == 'x');
    kill(pid, SIGKILL);
    assert_int_equal(waitpid(pid, NULL, 0), pid);
    struct pollfd end = {.fd = ends[0], .events = POLLIN};
    while (poll(&end, 1, 30000) == 1 && read(ends[0], &c, 1) == 1) {
    }
    assert_true(end.revents & POLLHUP);
    close(ends[0]);
    free(log);
}

static void add_job(void *context, int job, int worker)
{
    (void)worker;
    ((int *)context)[job] += job + 1;
}

static void test_threads_do_every_job_once(void **state)
{
    (void)state;
    int done[1000];
    for (int n = 0; n <= 8; n++) {
        Threads *threads = n ? fs_threads_new(n) : NULL;
        for (int round = 0; round < 20; round++) {
            memset(done, 0, sizeof done);
            fs_threads_for(threads, 1000, add_job, done);
            fs_threads_for(threads, 0, add_job, done);
            for (int i = 0; i < 1000; i++) assert_int_equal(done[i], i + 1);
        }
        if (threads) assert_int_equal(fs_threads_count(threads), n);
        fs_threads_free(threads);
    }
}

static atomic_int others_done;

static void wait_for_others_job(void *context, int job, int worker)
{
    (void)worker;
    const int n = *(const int *)context;
    while (job == 0 && others_done < n - 1) sched_yield();
    if (job) others_done++;
}

// The first job ends when all others are done: also those of its own thread's stretch, which another must take over.
static void test_threads_help_each_other(void **state)
{
    (void)state;
    for (int count = 2; count <= 5; count++) {
        Threads *threads = fs_threads_new(count);
        for (int n = 1; n <= 40; n++) {
            others_done = 0;
            fs_threads_for(threads, n, wait_for_others_job, &n);
            assert_int_equal(others_done, n - 1);
        }
        fs_threads_free(threads);
    }
}

static void test_arena(void **state)
{
    (void)state;
    Arena arena = {0};
    for (int step = 0; step < 4; step++) {
        char *part[50];
        for (int i = 0; i < 50; i++) {
            part[i] = fs_arena_alloc(&arena, (size_t)(1 + 977 * i));
            assert_int_equal((uintptr_t)part[i] % 64, 0);
            memset(part[i], i, (size_t)(1 + 977 * i));
        }
        for (int i = 0; i < 50; i++)
            for (int k = 0; k < 1 + 977 * i; k += 97) assert_int_equal(part[i][k], i);
        fs_arena_reset(&arena);
        char *block = arena.block;
        fs_arena_alloc(&arena, 1000);
        if (step) assert_ptr_equal(arena.block, block); // a steady step allocates nothing
        fs_arena_reset(&arena);
    }
    fs_arena_free(&arena);
}

static void test_random_numbers_never_change(void **state)
{
    (void)state;
    Rng rng = fs_rng_new(1), same = fs_rng_new(1), other = fs_rng_new(2);
    int equal = 0;
    double sum = 0, square = 0;
    for (int i = 0; i < 100000; i++) {
        uint32_t x = fs_rng_u32(&rng);
        assert_int_equal(x, fs_rng_u32(&same));
        equal += x == fs_rng_u32(&other);
        double z = fs_rng_normal(&same);
        rng = same;
        sum += z, square += z * z;
    }
    assert_true(equal < 3);
    assert_true(sum / 1e5 > -0.02 && sum / 1e5 < 0.02);
    assert_true(square / 1e5 > 0.98 && square / 1e5 < 1.02);
}

static void test_cpu(void **state)
{
    (void)state;
    CpuLevel level;
    FsError err = {0};
    assert_int_equal(fs_cpu_choose("best", &level, &err), 0);
    assert_int_equal(level, fs_cpu_best());
    assert_int_equal(fs_cpu_choose("scalar", &level, &err), 0);
    assert_int_equal(level, CPU_SCALAR);
    for (int l = 0; l < CPU_LEVELS; l++)
        assert_int_equal(fs_cpu_choose(fs_cpu_name(l), &level, &err) == 0, fs_cpu_has(l));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_write_is_whole_or_not, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_write_that_cannot_be, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_read_refuses, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_folders_and_names, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_list_is_sorted, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_process, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_process_dies_with_us, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_threads_do_every_job_once),
        cmocka_unit_test(test_threads_help_each_other),
        cmocka_unit_test(test_arena),
        cmocka_unit_test(test_random_numbers_never_change),
        cmocka_unit_test(test_cpu),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

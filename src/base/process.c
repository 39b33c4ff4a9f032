#include "base/process.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"

#define LEAVE 3 // seconds

bool fs_process_found(const char *program)
{
    const char *path = getenv("PATH");
    for (const char *p = path ? path : ""; *p;) {
        const char *end = strchrnul(p, ':');
        if (access(fs_file_at("%.*s/%s", (int)(end - p), p, program).text, X_OK) == 0) return true;
        p = *end ? end + 1 : end;
    }
    return false;
}

static void child(const char *const argv[], const char *log_path)
{
    setpgid(0, 0); // so that a Ctrl-C meant for us does not kill it before we decide to
    int in = open("/dev/null", O_RDONLY);
    int out = open(log_path, O_WRONLY | O_CREAT | O_APPEND, 0666);
    if (in >= 0) dup2(in, 0);
    if (out >= 0) dup2(out, 1), dup2(out, 2);
    execvp(argv[0], (char *const *)argv);
    _exit(127);
}

// The program that is meant, where env runs it.
static const char *program_of(const char *const *argv)
{
    if (strcmp(argv[0], "env") != 0) return argv[0];
    for (argv++; argv[0] && argv[1] && strchr(argv[0], '=');) argv++;
    return argv[0] ? argv[0] : "env";
}

int fs_process_run(const char *const argv[], const char *log_path, const Log *log, FsError *err)
{
    pid_t self = getpid(), pid = fork();
    if (pid < 0) return fs_error_set(err, FS_ERR_IO, "%s: cannot start: %s", argv[0], strerror(errno));
    if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != self) _exit(127); // we were killed before that
        child(argv, log_path);
    }
    int status;
    bool cancelled = false;
    for (;;) {
        pid_t done = waitpid(pid, &status, WNOHANG);
        if (done == pid) break;
        if (done < 0 && errno != EINTR)
            return fs_error_set(err, FS_ERR_IO, "%s: lost: %s", program_of(argv), strerror(errno));
        if (!cancelled && fs_log_cancelled(log)) {
            cancelled = true;
            kill(-pid, SIGKILL);
            kill(pid, SIGKILL);
        }
        nanosleep(&(struct timespec){.tv_nsec = 20 * 1000 * 1000}, NULL);
    }
    if (cancelled) return fs_error_set(err, FS_ERR_CANCELLED, "stopped while %s ran", program_of(argv));
    if (WIFSIGNALED(status))
        return fs_error_input(err, "%s died of signal %d (its output: %s)", program_of(argv), WTERMSIG(status),
                              log_path);
    if (WEXITSTATUS(status) == 127 && !fs_process_found(argv[0]))
        return fs_error_input(err, "%s: program not found; install it (Debian: apt-get install %s)", argv[0], argv[0]);
    return WEXITSTATUS(status);
}

int fs_process_leave(const char *const argv[], FsError *err)
{
    pid_t pid = fork();
    if (pid < 0) return fs_error_set(err, FS_ERR_IO, "%s: cannot start: %s", argv[0], strerror(errno));
    if (pid == 0) child(argv, "/dev/null");
    for (double begin = fs_clock_seconds(); fs_clock_seconds() - begin < LEAVE;) {
        int status;
        pid_t done = waitpid(pid, &status, WNOHANG);
        if (done == pid) return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
        if (done < 0 && errno != EINTR) break;
        nanosleep(&(struct timespec){.tv_nsec = 20 * 1000 * 1000}, NULL);
    }
    return 0;
}

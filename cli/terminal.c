// What a person sees while a command works: log lines, a progress bar on a terminal and plain lines elsewhere, and
// what Ctrl-C (or SIGTERM, SIGHUP) does: the first lets the stage save what it has, the second ends the program at
// once.
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include "cli.h"

#define SECONDS_BETWEEN_BARS 0.1
#define SECONDS_BETWEEN_LINES 10.0
#define BAR_WIDTH 24

static volatile sig_atomic_t stop_asked, saves; // saves: what is done so far is kept to go on from
static int stdout_error; // errno of the first line that could not be written

static void on_signal(int signal_number)
{
    (void)signal_number;
    if (stop_asked) _exit(EXIT_CANCELLED);
    stop_asked = 1;
    signal(SIGPIPE, SIG_IGN); // whoever read along may have been stopped, too: what is done is saved all the same
    static const char saving[] = "\nstopping: saving what is done (once more: at once)\n",
                      stopping[] = "\nstopping (once more: at once)\n";
    ssize_t written = saves ? write(STDERR_FILENO, saving, sizeof saving - 1)
                            : write(STDERR_FILENO, stopping, sizeof stopping - 1);
    (void)written; // nothing can be done where nothing can be said
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int columns(void)
{
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
    return size.ws_col < 300 ? size.ws_col : 300;
}

static void clear_bar(Terminal *terminal)
{
    if (!terminal->bar_shown) return;
    fputs("\r\033[K", stderr);
    fflush(stderr);
    terminal->bar_shown = false;
}

static void on_log(void *user, FsLogLevel level, const char *message)
{
    Terminal *terminal = user;
    if (level == FS_LOG_DEBUG && !terminal->verbose) return;
    if (level == FS_LOG_INFO && terminal->quiet && !terminal->prints) return;
    clear_bar(terminal);
    if (level == FS_LOG_WARN) {
        fprintf(stderr, "warning: %s\n", message);
    } else {
        errno = 0;
        fprintf(stdout, "%s\n", message);
        if (fflush(stdout) != 0 && !stdout_error) stdout_error = errno;
    }
}

// "1:23 left", or nothing while it cannot be told.
static void format_left(const Terminal *terminal, const FsProgress *p, double t, char *buf, size_t size)
{
    buf[0] = 0;
    if (strstr(p->text, " left")) return; // the stage knows better
    double elapsed = t - terminal->stage_start;
    int64_t worked = p->done - terminal->first_done;
    if (p->total <= p->done || worked < 1 || elapsed < 1) return;
    double left = elapsed * (double)(p->total - p->done) / (double)worked;
    if (!(left < 360000)) return;
    int s = (int)ceil(left);
    if (s >= 3600)
        snprintf(buf, size, "%d:%02d:%02d left", s / 3600, s / 60 % 60, s % 60);
    else
        snprintf(buf, size, "%d:%02d left", s / 60, s % 60);
}

static void show_bar(Terminal *terminal, const FsProgress *p, const char *left)
{
    char bar[BAR_WIDTH + 1], line[600];
    double share = p->total > 0 ? (double)p->done / (double)p->total : 0;
    if (share > 1) share = 1;
    int filled = (int)(share * BAR_WIDTH);
    for (int i = 0; i < BAR_WIDTH; i++) bar[i] = i < filled ? '#' : '.';
    bar[BAR_WIDTH] = 0;
    if (p->total > 0)
        snprintf(line, sizeof line, "%-10s [%s] %3d%% %lld/%lld  %s%s%s", p->stage, bar, (int)(100 * share),
                 (long long)p->done, (long long)p->total, left, *left ? "  " : "", p->text);
    else
        snprintf(line, sizeof line, "%-10s %lld  %s", p->stage, (long long)p->done, p->text);
    for (char *c = line; *c; c++)
        if (*c == '\n') *c = ' ';
    fprintf(stderr, "\r%.*s\033[K", columns() - 1, line);
    fflush(stderr);
    terminal->bar_shown = true;
}

static void show_line(const FsProgress *p, const char *left)
{
    fprintf(stderr, "%s: %lld", p->stage, (long long)p->done);
    if (p->total > 0) fprintf(stderr, "/%lld", (long long)p->total);
    if (*left) fprintf(stderr, "  %s", left);
    fprintf(stderr, "%s%s\n", *p->text ? "  " : "", p->text);
}

static void on_progress(void *user, const FsProgress *p)
{
    Terminal *terminal = user;
    if (terminal->quiet) return;
    double t = now();
    bool new_stage = strncmp(terminal->stage, p->stage, sizeof terminal->stage - 1) != 0;
    bool complete = p->total > 0 && p->done >= p->total;
    if (new_stage || p->done < terminal->done || p->total != terminal->total) { // parts count from their own start
        snprintf(terminal->stage, sizeof terminal->stage, "%s", p->stage);
        terminal->stage_start = t;
        terminal->first_done = p->done;
        if (new_stage) terminal->last_shown = terminal->tty ? 0 : t; // no line for the very start of a stage
    }
    terminal->done = p->done;
    terminal->total = p->total;
    double wait = terminal->tty ? SECONDS_BETWEEN_BARS : SECONDS_BETWEEN_LINES;
    if (!complete && t - terminal->last_shown < wait) return;
    terminal->last_shown = t;
    char left[32];
    format_left(terminal, p, t, left, sizeof left);
    if (terminal->tty)
        show_bar(terminal, p, left);
    else
        show_line(p, left);
}

static bool on_cancelled(void *user)
{
    (void)user;
    return stop_asked;
}

void cli_terminal_start(Terminal *terminal, const Invocation *in)
{
    const char *term = getenv("TERM");
    *terminal = (Terminal){.quiet = in->quiet, .verbose = in->verbose, .prints = in->command->prints};
    terminal->tty = isatty(STDERR_FILENO) && term && strcmp(term, "dumb") != 0;
    saves = (in->command->stages & FS_STAGE_TRAIN) != 0;
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
        struct sigaction old;
        if (sigaction(signals[i], NULL, &old) == 0 && old.sa_handler != SIG_IGN) sigaction(signals[i], &action, NULL);
    } // one that is ignored, as nohup and shells in the background do, stays so
}

FsCallbacks cli_terminal_callbacks(Terminal *terminal)
{
    return (FsCallbacks){.log = on_log, .progress = on_progress, .cancelled = on_cancelled, .user = terminal};
}

void cli_terminal_finish(Terminal *terminal)
{
    clear_bar(terminal);
}

int cli_terminal_close(void)
{
    errno = 0;
    bool failed = ferror(stdout) != 0;
    failed |= fclose(stdout) != 0;
    return !failed ? 0 : stdout_error ? stdout_error : errno ? errno : EIO;
}

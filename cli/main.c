// The program `flashsplat`: finds the command, reads its options, calls the library, turns errors into exit codes.
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli.h"

static int exit_code(int rc)
{
    switch (rc) {
    case FS_DOUBTS: return EXIT_DOUBTS;
    case FS_ERR_USAGE: return EXIT_USAGE;
    case FS_ERR_CANCELLED: return EXIT_CANCELLED;
    default: return rc < 0 ? EXIT_FAILED : EXIT_OK;
    }
}

static int run_command(const Command *command, int argc, char **argv)
{
    FsError err = {0};
    Invocation invocation = {.command = command, .settings = fs_settings_new()};
    if (!invocation.settings) {
        fprintf(stderr, "flashsplat: out of memory\n");
        return EXIT_FAILED;
    }
    int rc = cli_args_parse(argc, argv, &invocation, &err);
    if (rc == 0 && invocation.help) {
        cli_help_command(stdout, command);
    } else if (rc == 0) {
        Terminal terminal;
        cli_terminal_start(&terminal, &invocation);
        FsCallbacks callbacks = cli_terminal_callbacks(&terminal);
        rc = command->call(&invocation, &callbacks, &err);
        cli_terminal_finish(&terminal);
    }
    fs_settings_free(invocation.settings);
    if (rc < 0) fprintf(stderr, "flashsplat: %s\n", err.message);
    if (rc == FS_ERR_USAGE) fprintf(stderr, "Try: flashsplat %s --help\n", command->name);
    return exit_code(rc);
}

static const char *command_name(size_t i)
{
    size_t n;
    return cli_commands(&n)[i].name;
}

static const Command *find_or_complain(const char *name)
{
    const Command *command = cli_command_find(name);
    if (command) return command;
    size_t n;
    cli_commands(&n);
    const char *nearest = cli_args_nearest(name, command_name, n);
    fprintf(stderr, "flashsplat: '%s' is not a command", name);
    if (nearest) fprintf(stderr, "; did you mean '%s'?", nearest);
    fprintf(stderr, "\nTry: flashsplat --help\n");
    return NULL;
}

static bool is_help(const char *word)
{
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0;
}

static int one_too_many(const char *word)
{
    fprintf(stderr, "flashsplat: '%s' is one argument too many\nTry: flashsplat --help\n", word);
    return EXIT_USAGE;
}

static int help(int argc, char **argv)
{
    if (argc < 1 ||
        (argc == 1 && (is_help(argv[0]) || strcmp(argv[0], "help") == 0 || strcmp(argv[0], "version") == 0))) {
        cli_help_usage(stdout);
        return EXIT_OK;
    }
    if (argc == 2 && is_help(argv[1])) argc--;
    const Command *command = find_or_complain(argv[0]);
    if (!command) return EXIT_USAGE;
    if (argc > 1) return one_too_many(argv[1]);
    cli_help_command(stdout, command);
    return EXIT_OK;
}

static int dispatch(int argc, char **argv)
{
    if (argc < 2) {
        cli_help_usage(stderr);
        return EXIT_USAGE;
    }
    const char *word = argv[1];
    if (strcmp(word, "help") == 0 || is_help(word)) return help(argc - 2, argv + 2);
    if (strcmp(word, "version") == 0 || strcmp(word, "--version") == 0) {
        if (argc == 3 && is_help(argv[2])) return help(0, NULL);
        if (argc > 2) return one_too_many(argv[2]);
        printf("flashsplat %s\n", fs_version());
        return EXIT_OK;
    }
    if (strcmp(word, "--man") == 0) { // how the build makes the manual page
        cli_help_man(stdout);
        return EXIT_OK;
    }
    const Command *command = find_or_complain(word);
    return command ? run_command(command, argc - 2, argv + 2) : EXIT_USAGE;
}

// Where standard files are closed, what is opened first would get their numbers, and messages.
static void fill_standard_files(void)
{
    int fd = open("/dev/null", O_RDWR);
    while (fd >= 0 && fd < 3) fd = dup(fd);
    if (fd >= 0) close(fd);
}

// ---- a stack of the usual size where `ulimit -s` gives next to none ----

#define LITTLE_STACK ((size_t)2 << 20) // bytes
#define USUAL_STACK ((size_t)8 << 20)

typedef struct Words {
    int argc;
    char **argv;
    int code;
} Words;

static void *dispatch_aside(void *user)
{
    Words *words = user;
    words->code = dispatch(words->argc, words->argv);
    return NULL;
}

static int dispatch_with_room(int argc, char **argv)
{
    Words words = {argc, argv, EXIT_FAILED};
    pthread_attr_t attr;
    pthread_t thread;
    size_t size = USUAL_STACK;
    bool aside = false;
    if (pthread_attr_init(&attr) != 0) return dispatch(argc, argv);
    pthread_attr_getstacksize(&attr, &size); // what threads get by themselves follows from the limit
    if (size < LITTLE_STACK && pthread_attr_setstacksize(&attr, USUAL_STACK) == 0) {
        pthread_setattr_default_np(&attr); // for the threads to come, too
        aside = pthread_create(&thread, &attr, dispatch_aside, &words) == 0 && pthread_join(thread, NULL) == 0;
    }
    pthread_attr_destroy(&attr);
    return aside ? words.code : dispatch(argc, argv);
}

int main(int argc, char **argv)
{
    fill_standard_files();
    signal(SIGXFSZ, SIG_IGN); // a file that grows beyond the limit is one that cannot be written
    int code = dispatch_with_room(argc, argv);
    int lost = cli_terminal_close();
    if (!lost) return code;
    fprintf(stderr, "flashsplat: cannot write to standard output: %s\n", strerror(lost));
    return code == EXIT_USAGE || code == EXIT_CANCELLED ? code : EXIT_FAILED;
}

// What the files of the command line share: the table of commands and one parsed command line.
#ifndef FLASHSPLAT_CLI_H
#define FLASHSPLAT_CLI_H

#include <stdio.h>

#include "flashsplat.h"

enum { EXIT_OK = 0, EXIT_FAILED = 1, EXIT_USAGE = 2, EXIT_DOUBTS = 3, EXIT_CANCELLED = 130 };

// What "-o" names.
typedef enum OutKind {
    OUT_NONE,    // the command has no -o
    OUT_NEW,     // the project folder or the file to write; must be given
    OUT_PROJECT, // the project folder; may also be the first argument
    OUT_SETTING, // the setting "output"; the project folder is the first argument
} OutKind;

typedef struct Invocation Invocation;

typedef struct Command {
    const char *name;
    const char *usage;  // arguments, as in "PHOTOS -o OUT"
    const char *help;   // one line
    const char *detail; // a paragraph more for --help and the manual, or NULL
    unsigned stages;    // FS_STAGE_* mask: the settings that are options of this command
    int n_args;         // arguments besides the project folder
    OutKind out;
    bool prints; // its log lines are its result: they go to standard output even with --quiet
    int (*call)(const Invocation *invocation, const FsCallbacks *callbacks, FsError *err);
} Command;

struct Invocation {
    const Command *command;
    FsSettings *settings;
    const char *arg[2]; // n_args of them
    const char *out;
    bool help, quiet, verbose;
};

// commands.c
const Command *cli_commands(size_t *n);
const Command *cli_command_find(const char *name);

// args.c: 0, or FS_ERR_USAGE with the message in err. argv starts after the command's name.
int cli_args_parse(int argc, char **argv, Invocation *invocation, FsError *err);
// The nearest of n names, or NULL when none is near.
const char *cli_args_nearest(const char *word, const char *(*name)(size_t i), size_t n);

// help.c
void cli_help_usage(FILE *f);
void cli_help_command(FILE *f, const Command *command);
void cli_help_man(FILE *f);

// terminal.c: log lines, the progress bar and Ctrl-C.
typedef struct Terminal {
    bool tty, quiet, verbose, prints, bar_shown;
    char stage[32];
    double stage_start, last_shown;
    int64_t first_done, done, total; // of the stage, or of its part
} Terminal;
void cli_terminal_start(Terminal *terminal, const Invocation *invocation); // also catches SIGINT, SIGTERM and SIGHUP
FsCallbacks cli_terminal_callbacks(Terminal *terminal);
void cli_terminal_finish(Terminal *terminal);
int cli_terminal_close(void); // standard output; the errno of what could not be written to it, or 0

#endif

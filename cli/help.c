// The help of each command and the manual page, both made from the tables of commands and settings.
#include <stdlib.h>
#include <string.h>

#include "cli.h"

static const struct {
    unsigned stage;
    const char *title;
} groups[] = {
    {0, "More than one stage"}, // those of several stages of the command
    {FS_STAGE_INGEST, "ingest"}, {FS_STAGE_POSES, "poses"},   {FS_STAGE_INITIALISE, "initialise"},
    {FS_STAGE_TRAIN, "train"},   {FS_STAGE_RENDER, "render"}, {FS_STAGE_EVALUATE, "evaluate"},
    {FS_STAGE_EXPORT, "export"}, {FS_STAGE_SYNTH, "synth"},   {FS_STAGE_PAIR, "pair"},
    {FS_STAGE_BENCH, "bench"},   {FS_STAGE_CHECK, "check"},   {FS_STAGE_VIEW, "view"},
};
#define N_GROUPS (sizeof groups / sizeof *groups)

static bool several(unsigned stages)
{
    return (stages & (stages - 1)) != 0;
}

static bool in_group(const FsOption *option, unsigned command_stages, size_t group)
{
    unsigned stages = option->stages & command_stages;
    return several(stages) ? group == 0 : stages && stages == groups[group].stage;
}

// "--name ARGUMENT" into buf.
static void option_flag(const FsOption *option, char *buf, size_t size)
{
    snprintf(buf, size, "--%s%s%s", option->name, option->argument ? " " : "",
             option->argument ? option->argument : "");
}

// " (default: X)" into buf, empty where the default is an empty text that the help explains.
static void option_default(const FsSettings *defaults, const FsOption *option, char *buf, size_t size)
{
    char value[200] = "";
    fs_settings_get(defaults, option->name, value, sizeof value);
    if (option->type == FS_OPTION_BOOL)
        snprintf(buf, size, " (default: %s)", value[0] == 't' ? "on" : "off");
    else if (*value)
        snprintf(buf, size, " (default: %s)", value);
    else
        snprintf(buf, size, "%s", strstr(option->help, "default:") ? "" : " (default: none)");
}

// " --steps 3000 --long-edge 600": what a preset sets that differs from the defaults.
static void preset_values(const FsSettings *defaults, const char *preset, char *buf, size_t size)
{
    size_t n, used = 0;
    const FsOption *options = fs_settings_options(&n);
    FsSettings *settings = fs_settings_new();
    buf[0] = 0;
    if (!settings || fs_settings_set(settings, "preset", preset, NULL) < 0) goto done;
    for (size_t i = 0; i < n; i++) {
        char was[200] = "", is[200] = "";
        if (strcmp(options[i].name, "preset") == 0) continue;
        fs_settings_get(defaults, options[i].name, was, sizeof was);
        fs_settings_get(settings, options[i].name, is, sizeof is);
        if (strcmp(was, is) == 0 || used >= size) continue;
        if (options[i].type == FS_OPTION_BOOL)
            used += (size_t)snprintf(buf + used, size - used, " --%s%s", strcmp(is, "true") == 0 ? "" : "no-",
                                     options[i].name);
        else
            used += (size_t)snprintf(buf + used, size - used, " --%s %s", options[i].name, is);
    }
done:
    fs_settings_free(settings);
}

void cli_help_usage(FILE *f)
{
    size_t n;
    const Command *commands = cli_commands(&n);
    fputs("flashsplat separates what is behind glass from what is mirrored in it.\n\n"
          "Usage: flashsplat COMMAND ...\n\n",
          f);
    for (size_t i = 0; i < n; i++) {
        char left[64];
        snprintf(left, sizeof left, "%s %s", commands[i].name, commands[i].usage);
        fprintf(f, "  %-28s %s\n", left, commands[i].help);
    }
    fprintf(f, "  %-28s %s\n  %-28s %s\n\n", "help [COMMAND]", "this help, or a command's", "version", "the version");
    fputs("Start with: flashsplat run PHOTOS -o OUT\nOptions of a command: flashsplat COMMAND --help\n", f);
}

static void print_options(FILE *f, const Command *command, const FsSettings *defaults)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    for (size_t group = 0; group < N_GROUPS; group++) {
        bool titled = false;
        for (size_t i = 0; i < n; i++) {
            char flag[128], text[256];
            if (!in_group(&options[i], command->stages, group)) continue;
            if (!titled) fprintf(f, "\n%s:\n", several(command->stages) ? groups[group].title : "Options");
            titled = true;
            option_flag(&options[i], flag, sizeof flag);
            option_default(defaults, &options[i], text, sizeof text);
            fprintf(f, "  %-34s %s%s\n", flag, options[i].help, text);
        }
    }
}

static bool has_preset(const Command *command)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    for (size_t i = 0; i < n; i++)
        if (strcmp(options[i].name, "preset") == 0) return (options[i].stages & command->stages) != 0;
    return false;
}

static void print_presets(FILE *f, const FsSettings *defaults)
{
    const char *help, *name;
    fputs("\nPresets (an option given beside --preset wins):\n", f);
    for (size_t i = 0; (name = fs_settings_preset(i, &help)); i++) {
        char values[1000];
        preset_values(defaults, name, values, sizeof values);
        fprintf(f, "  %-34s %s%s%s\n", name, help, *values ? ":" : "", values);
    }
}

void cli_help_command(FILE *f, const Command *command)
{
    FsSettings *defaults = fs_settings_new();
    if (!defaults) return;
    fprintf(f, "Usage: flashsplat %s%s%s [OPTION...]\n\n%s\n", command->name, *command->usage ? " " : "",
            command->usage, command->help);
    if (command->detail) fprintf(f, "%s\n", command->detail);
    print_options(f, command, defaults);
    if (has_preset(command)) print_presets(f, defaults);
    fputs("\nEvery command:\n", f);
    fprintf(f, "  %-34s %s\n  %-34s %s\n  %-34s %s\n", "-q, --quiet", "no progress, only warnings and results",
            "-v, --verbose", "more about what is done", "-h, --help", "this help");
    fputs("\nAn on-or-off option --x is turned off by --no-x. Exit codes: 0 done, 1 failed, 2 wrong usage, "
          "3 done with doubts (check), 130 interrupted.\n",
          f);
    fs_settings_free(defaults);
}

// ---- the manual page ----

// Text as roff wants it: backslashes, hyphens of options and leading dots escaped.
static void roff(FILE *f, const char *text)
{
    for (const char *c = text; *c; c++) {
        if (*c == '\\')
            fputs("\\e", f);
        else if (*c == '-')
            fputs("\\-", f);
        else if ((*c == '.' || *c == '\'') && c == text)
            fprintf(f, "\\&%c", *c);
        else
            fputc(*c, f);
    }
}

static void roff_item(FILE *f, const char *term, const char *text, const char *more)
{
    fputs(".TP\n\\fB", f);
    roff(f, term);
    fputs("\\fR\n", f);
    roff(f, text);
    fputs(more, f);
    fputc('\n', f);
}

static void man_commands(FILE *f)
{
    size_t n;
    const Command *commands = cli_commands(&n);
    fputs(".SH COMMANDS\n", f);
    for (size_t i = 0; i < n; i++) {
        char term[128];
        snprintf(term, sizeof term, "%s %s", commands[i].name, commands[i].usage);
        roff_item(f, term, commands[i].help, ".");
        if (!commands[i].detail) continue;
        roff(f, commands[i].detail);
        fputc('\n', f);
    }
    roff_item(f, "help [COMMAND]", "the overview, or a command's options with their defaults", ".");
    roff_item(f, "version", "the version; --version, too", ".");
}

// The commands that take an option, as "run, train".
static void commands_of(const FsOption *option, char *buf, size_t size)
{
    size_t n, used = 0;
    const Command *commands = cli_commands(&n);
    buf[0] = 0;
    for (size_t i = 0; i < n && used < size; i++)
        if (commands[i].stages & option->stages)
            used += (size_t)snprintf(buf + used, size - used, "%s%s", used ? ", " : "", commands[i].name);
}

static void man_options(FILE *f, const FsSettings *defaults)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    fputs(".SH OPTIONS\nWritten \\-\\-name value or \\-\\-name=value; an on-or-off option is turned off by "
          "\\-\\-no\\-name.\n",
          f);
    for (size_t i = 0; i < n; i++) {
        char flag[128], preset[256], more[400], names[200];
        option_flag(&options[i], flag, sizeof flag);
        option_default(defaults, &options[i], preset, sizeof preset);
        commands_of(&options[i], names, sizeof names);
        snprintf(more, sizeof more, "%s.\nCommands: %s.", preset, names);
        roff_item(f, flag, options[i].help, more);
    }
    roff_item(f, "-o NAME", "the folder or file to write", "");
    roff_item(f, "-q, --quiet", "no progress, only warnings and results", "");
    roff_item(f, "-v, --verbose", "more about what is done", "");
    roff_item(f, "-h, --help", "the command's options", "");
}

void cli_help_man(FILE *f)
{
    FsSettings *defaults = fs_settings_new();
    if (!defaults) return;
    fprintf(f, ".TH FLASHSPLAT 1 \"\" \"flashsplat %s\" \"User Commands\"\n", fs_version());
    fputs(".SH NAME\nflashsplat \\- separate what is behind glass from what is mirrored in it\n"
          ".SH SYNOPSIS\n.B flashsplat\n.I COMMAND\n.RI [ OPTION... ]\n"
          ".SH DESCRIPTION\nFrom photos taken through glass, some with the flash and some without, flashsplat makes "
          "two 3D scenes: what is behind the glass and what is mirrored in it.\n"
          "Start with\n.PP\n.RS\nflashsplat run \\fIPHOTOS\\fR \\-o \\fIOUT\\fR\n.RE\n",
          f);
    man_commands(f);
    man_options(f, defaults);
    fputs(".SH PRESETS\nAn option given beside \\-\\-preset wins.\n", f);
    const char *help, *name;
    for (size_t i = 0; (name = fs_settings_preset(i, &help)); i++) {
        char values[1000], text[1200];
        preset_values(defaults, name, values, sizeof values);
        snprintf(text, sizeof text, "%s%s%s", help, *values ? ":" : "", values);
        roff_item(f, name, text, "");
    }
    fputs(".SH EXIT STATUS\n.TP\n0\nDone.\n.TP\n1\nFailed; one line on standard error says why.\n.TP\n2\nThe command "
          "line is wrong.\n.TP\n3\nOf check: usable with doubts.\n.TP\n130\nInterrupted; what was computed is kept.\n",
          f);
    fs_settings_free(defaults);
}

// Reads a command line: the options are the settings whose stages the command has, and -o, -q, -v, --help.
#include <stdarg.h>
#include <string.h>

#include "cli.h"

__attribute__((format(printf, 2, 3))) static int usage_error(FsError *err, const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    vsnprintf(err->message, sizeof err->message, format, ap);
    va_end(ap);
    return err->code = FS_ERR_USAGE;
}

// Levenshtein's distance of two words, both cut to 63 letters.
static size_t word_distance(const char *a, const char *b)
{
    size_t row[64], na = strnlen(a, 63), nb = strnlen(b, 63);
    for (size_t j = 0; j <= nb; j++) row[j] = j;
    for (size_t i = 1; i <= na; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= nb; j++) {
            size_t above = row[j], best = diagonal + (a[i - 1] != b[j - 1]);
            if (above + 1 < best) best = above + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            diagonal = above;
            row[j] = best;
        }
    }
    return row[nb];
}

const char *cli_args_nearest(const char *word, const char *(*name)(size_t i), size_t n)
{
    const char *nearest = NULL;
    size_t best = strlen(word) / 3 + 2; // at least this far: not near
    for (size_t i = 0; i < n; i++) {
        if (!name(i)) continue;
        bool prefix = strlen(word) >= 3 && strncmp(word, name(i), strlen(word)) == 0;
        size_t distance = prefix ? 1 : word_distance(word, name(i));
        if (distance < best) {
            best = distance;
            nearest = name(i);
        }
    }
    return nearest;
}

static const char *option_name(size_t i)
{
    size_t n;
    return fs_settings_options(&n)[i].name;
}

// The option called word[0..length), NULL when there is none.
static const FsOption *find_option(const char *word, size_t length)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    for (size_t i = 0; i < n; i++)
        if (strlen(options[i].name) == length && strncmp(options[i].name, word, length) == 0) return &options[i];
    return NULL;
}

static int unknown_option(const Command *command, const char *word, size_t length, FsError *err)
{
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)(length < 63 ? length : 63), word);
    if (find_option(word, length)) return usage_error(err, "--%s is not an option of '%s'", name, command->name);
    size_t n;
    fs_settings_options(&n);
    const char *nearest = cli_args_nearest(name, option_name, n);
    const FsOption *option = nearest ? find_option(nearest, strlen(nearest)) : NULL;
    if (option && option->stages & command->stages)
        return usage_error(err, "--%s is not an option; did you mean --%s?", name, nearest);
    return usage_error(err, "--%s is not an option of '%s'", name, command->name);
}

static int set_value(const Invocation *in, const FsOption *option, const char *value, FsError *err)
{
    if (!*value && option->type == FS_OPTION_STRING) // a variable that is not set, say
        return usage_error(err, "--%s is empty: it needs a value: %s", option->name, option->argument);
    return fs_settings_set(in->settings, option->name, value, err);
}

// One "--name", "--name=value", "--name value" or "--no-name"; *i is moved over a value of its own.
static int parse_long(int argc, char **argv, int *i, Invocation *in, FsError *err)
{
    const char *word = argv[*i] + 2, *equals = strchr(word, '=');
    size_t length = equals ? (size_t)(equals - word) : strlen(word);
    unsigned stages = in->command->stages;
    const FsOption *option = find_option(word, length);
    if (option && option->stages & stages) {
        if (equals) return set_value(in, option, equals + 1, err);
        if (option->type == FS_OPTION_BOOL) return fs_settings_set(in->settings, option->name, "true", err);
        if (*i + 1 >= argc || strncmp(argv[*i + 1], "--", 2) == 0)
            return usage_error(err, "--%s needs a value: %s", option->name, option->argument);
        return set_value(in, option, argv[++*i], err);
    }
    if (length > 3 && strncmp(word, "no-", 3) == 0) {
        option = find_option(word + 3, length - 3);
        if (option && option->stages & stages && option->type == FS_OPTION_BOOL)
            return equals ? usage_error(err, "--no-%s takes no value", option->name)
                          : fs_settings_set(in->settings, option->name, "false", err);
    }
    return unknown_option(in->command, word, length, err);
}

// Options that are not settings. Returns 1 when the word was one of them, 0 when not.
static int parse_own(int argc, char **argv, int *i, Invocation *in, FsError *err)
{
    const char *word = argv[*i];
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) return in->help = true;
    if (strcmp(word, "--quiet") == 0 || strcmp(word, "-q") == 0) return in->quiet = true;
    if (strcmp(word, "--verbose") == 0 || strcmp(word, "-v") == 0) return in->verbose = true;
    if (strncmp(word, "-o", 2) != 0) return 0;
    if (in->command->out == OUT_NONE) return usage_error(err, "'%s' has no -o", in->command->name);
    const char *value = word[2] ? word + 2 : *i + 1 < argc ? argv[++*i] : "";
    if (!*value) return usage_error(err, "-o needs a name");
    if (in->command->out == OUT_SETTING) {
        int rc = fs_settings_set(in->settings, "output", value, err);
        return rc < 0 ? rc : 1;
    }
    if (in->out) return usage_error(err, "-o was given twice: %s and %s", in->out, value);
    in->out = value;
    return 1;
}

// Gives the words that are not options their meaning.
static int assign_words(Invocation *in, const char *const *words, int n, FsError *err)
{
    const Command *command = in->command;
    bool first_is_project = command->out == OUT_SETTING || (command->out == OUT_PROJECT && !in->out);
    int expected = command->n_args + first_is_project;
    if (n > expected) return usage_error(err, "'%s' is one argument too many", words[expected]);
    if (n < expected)
        return usage_error(err, "an argument is missing: flashsplat %s %s", command->name, command->usage);
    if (command->out == OUT_NEW && !in->out)
        return usage_error(err, "-o is missing: flashsplat %s %s", command->name, command->usage);
    if (first_is_project) in->out = *words++;
    for (int i = 0; i < command->n_args; i++) in->arg[i] = words[i];
    for (int i = 0; i < expected; i++)
        if (!*words[i - first_is_project]) return usage_error(err, "an argument is empty");
    return 0;
}

// Whether a setting is other than its default.
static bool is_used(const FsSettings *settings, const char *name)
{
    char value[16];
    const FsOption *option = find_option(name, strlen(name));
    return fs_settings_get(settings, name, value, sizeof value) == 0 && strcmp(value, option->initial) != 0;
}

// Options that only say how another does its work.
static int check_companions(const FsSettings *settings, FsError *err)
{
    static const struct {
        const char *option, *of, *other;
    } row[] = {{"dataset-of", "dataset", NULL},
               {"originals", "clean", NULL},
               {"port", "serve", NULL},
               {"method-encoding", "method", NULL},
               {"path-views", "video", "path"}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const char *other = row[i].other;
        if (!is_used(settings, row[i].option) || is_used(settings, row[i].of) || (other && is_used(settings, other)))
            continue;
        return usage_error(err, "--%s does nothing without --%s%s%s", row[i].option, row[i].of, other ? " or --" : "",
                           other ? other : "");
    }
    return 0;
}

int cli_args_parse(int argc, char **argv, Invocation *in, FsError *err)
{
    const char *words[4]; // one more than any command takes
    int n = 0;
    bool options_over = false;
    for (int i = 0; i < argc; i++) {
        const char *word = argv[i];
        if (!options_over && strcmp(word, "--") == 0) {
            options_over = true;
            continue;
        }
        if (options_over || word[0] != '-' || !word[1]) {
            if (n < 4) words[n++] = word;
            continue;
        }
        int rc = parse_own(argc, argv, &i, in, err);
        if (rc == 0 && strncmp(word, "--", 2) == 0)
            rc = parse_long(argc, argv, &i, in, err);
        else if (rc == 0)
            rc = usage_error(err, "%s is not an option of '%s'", word, in->command->name);
        if (rc < 0) return rc;
    }
    if (in->help) return 0;
    int rc = check_companions(in->settings, err);
    return rc < 0 ? rc : assign_words(in, words, n, err);
}

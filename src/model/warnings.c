#include "model/warnings.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"
#include "model/project.h"

#define MAX_BYTES 65536 // of a stage's warnings; later ones are not kept

struct Warnings {
    FsCallbacks to;
    char *out;
    const char *stage;
    bool renewing;
    char *held; // lines, while renewing; NULL: none
};

static FilePath file_of(const char *out, const char *stage)
{
    return fs_file_at("%s/warnings/%s.txt", out, stage);
}

static bool has_line(const char *text, const char *line)
{
    size_t n = strlen(line);
    for (const char *p = text; p && *p; p = strchr(p, '\n') ? strchr(p, '\n') + 1 : NULL)
        if (strncmp(p, line, n) == 0 && (p[n] == '\n' || p[n] == 0)) return true;
    return false;
}

static void hold(Warnings *warnings, const char *line)
{
    char *held = warnings->held ? fs_file_path("%s%s\n", warnings->held, line) : fs_file_path("%s\n", line);
    if (!held) return; // counted there
    free(warnings->held);
    warnings->held = held;
}

// Keeping a warning is a courtesy: where the disk will not have it, the log still has it.
static void keep(Warnings *warnings, const char *message)
{
    FilePath path = file_of(warnings->out, warnings->stage);
    char *text = NULL, *line = strdup(message);
    size_t size = 0;
    if (!line) fs_error_memory(NULL);
    if (!line) goto out;
    for (char *p = line; *p; p++)
        if (*p == '\n' || *p == '\r') *p = ' ';
    if (warnings->renewing) {
        hold(warnings, line);
        goto out;
    }
    if (fs_file_exists(path.text) && fs_file_read(path.text, MAX_BYTES, &text, &size, NULL) < 0) goto out;
    if (size + strlen(line) + 1 > MAX_BYTES || has_line(text, line)) goto out;
    if (fs_file_mkdirs(fs_file_at("%s/warnings", warnings->out).text, NULL) < 0) goto out;
    char *whole = fs_owned_check(path.text, NULL) < 0 ? NULL : fs_file_path("%s\n", line);
    if (whole) fs_file_append(path.text, whole, NULL);
    free(whole);
out:
    free(text);
    free(line);
}

static void pass_log(void *user, FsLogLevel level, const char *message)
{
    Warnings *warnings = user;
    if (level == FS_LOG_WARN && warnings->stage) keep(warnings, message);
    if (warnings->to.log) warnings->to.log(warnings->to.user, level, message);
}

static void pass_progress(void *user, const FsProgress *progress)
{
    const Warnings *warnings = user;
    warnings->to.progress(warnings->to.user, progress);
}

static bool pass_cancelled(void *user)
{
    const Warnings *warnings = user;
    return warnings->to.cancelled(warnings->to.user);
}

int fs_warnings_new(Warnings **result, const char *out, const FsCallbacks *callbacks, Log *log, FsError *err)
{
    Warnings *warnings = *result = calloc(1, sizeof *warnings);
    if (!warnings || !(warnings->out = strdup(out))) {
        free(warnings);
        *result = NULL;
        return fs_error_memory(err);
    }
    if (callbacks) warnings->to = *callbacks;
    *log = (Log){.log = pass_log, .user = warnings};
    if (warnings->to.progress) log->progress = pass_progress;
    if (warnings->to.cancelled) log->cancelled = pass_cancelled;
    return 0;
}

void fs_warnings_free(Warnings *warnings)
{
    if (!warnings) return;
    free(warnings->held);
    free(warnings->out);
    free(warnings);
}

void fs_warnings_stage(Warnings *warnings, const char *stage)
{
    warnings->stage = stage;
    warnings->renewing = false;
    free(warnings->held);
    warnings->held = NULL;
}

void fs_warnings_renew(Warnings *warnings)
{
    if (warnings) warnings->renewing = true;
}

void fs_warnings_settle(Warnings *warnings)
{
    if (!warnings || !warnings->renewing || !warnings->stage) return;
    char *rest, *held = warnings->held;
    warnings->renewing = false;
    warnings->held = NULL;
    fs_owned_remove(file_of(warnings->out, warnings->stage).text);
    for (char *line = held ? strtok_r(held, "\n", &rest) : NULL; line; line = strtok_r(NULL, "\n", &rest))
        keep(warnings, line);
    free(held);
}

char *fs_warnings_read(const char *out)
{
    char *all = NULL;
    for (int i = 0; i < PROJECT_STAGES; i++) {
        FilePath path = file_of(out, fs_project_stages[i].name);
        char *text = NULL;
        size_t size;
        if (fs_file_exists(path.text) && fs_file_read(path.text, MAX_BYTES, &text, &size, NULL) == 0 && *text) {
            char *joined = fs_file_path("%s%s", all ? all : "", text);
            free(all);
            all = joined;
        }
        free(text);
    }
    return all;
}

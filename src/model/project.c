// Done marks: OUT/done/<stage>.json holds the settings a stage ran with. A stage is done while its mark is there and
// those settings are the ones asked for now; a stage that starts removes its own mark and those of the stages that
// read its results, and the checkpoint of a training that its results would feed.
#include "model/project.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"

#define MAX_MARK_BYTES (1 << 20)

// after: the stages whose results a stage reads, directly or not.
static const struct {
    const char *name;
    unsigned stage, after;
} stages[] = {
    {"ingest", FS_STAGE_INGEST, 0},
    {"poses", FS_STAGE_POSES, FS_STAGE_INGEST},
    {"initialise", FS_STAGE_INITIALISE, FS_STAGE_INGEST | FS_STAGE_POSES},
    {"train", FS_STAGE_TRAIN, FS_STAGE_INGEST | FS_STAGE_POSES | FS_STAGE_INITIALISE},
    {"render", FS_STAGE_RENDER, FS_STAGE_INGEST | FS_STAGE_POSES | FS_STAGE_INITIALISE | FS_STAGE_TRAIN},
    {"evaluate", FS_STAGE_EVALUATE,
     FS_STAGE_INGEST | FS_STAGE_POSES | FS_STAGE_INITIALISE | FS_STAGE_TRAIN | FS_STAGE_RENDER},
    {"export", FS_STAGE_EXPORT, FS_STAGE_INGEST | FS_STAGE_POSES | FS_STAGE_INITIALISE | FS_STAGE_TRAIN},
};
#define N_STAGES (sizeof stages / sizeof *stages)

// Settings that say how a stage works, not what it computes; and the preset, which counts through the values it sets,
// but for the stages it steers by name.
static bool changes_result(const char *name, unsigned stage_mask)
{
    static const char *const ignored[] = {"threads", "cpu", "force", "resume", "checkpoint-every", "progress-every"};
    for (size_t i = 0; i < sizeof ignored / sizeof *ignored; i++)
        if (strcmp(name, ignored[i]) == 0) return false;
    return strcmp(name, "preset") != 0 || (stage_mask & (FS_STAGE_INITIALISE | FS_STAGE_TRAIN));
}

static json_t *current_settings(const FsProject *project, unsigned stage_mask)
{
    char *text = fs_settings_json(&project->set, stage_mask);
    json_t *all = text ? json_loads(text, 0, NULL) : NULL, *kept = all ? json_object() : NULL;
    free(text);
    const char *name;
    json_t *value;
    if (kept)
        json_object_foreach(all, name, value) if (changes_result(name, stage_mask)) json_object_set(kept, name, value);
    json_decref(all);
    return kept;
}

static json_t *read_mark(const char *path)
{
    char *text;
    size_t size;
    if (fs_file_read(path, MAX_MARK_BYTES, &text, &size, NULL) < 0) return NULL;
    json_t *mark = json_loadb(text, size, 0, NULL);
    free(text);
    return mark;
}

static void log_change(const Log *log, const char *stage, const char *name, const json_t *was, const json_t *now)
{
    char *was_text = was ? json_dumps(was, JSON_ENCODE_ANY) : NULL, *now_text = json_dumps(now, JSON_ENCODE_ANY);
    fs_log_info(log, "%s: done again, --%s was %s and is %s now", stage, name, was_text ? was_text : "not there",
                now_text ? now_text : "?");
    free(was_text);
    free(now_text);
}

static bool is_done(const FsProject *project, const char *stage, unsigned stage_mask)
{
    if (project->set.force) return false;
    char *path = fs_file_path("%s/done/%s.json", project->out, stage);
    if (!path || !fs_file_exists(path)) {
        free(path);
        return false;
    }
    json_t *mark = read_mark(path), *was = json_object_get(mark, "settings");
    json_t *now = current_settings(project, stage_mask);
    bool done = now && json_is_object(was);
    if (!done) fs_log_warn(&project->log, "%s: not a mark of a finished stage; %s is done again", path, stage);
    const char *name;
    json_t *value;
    if (done) json_object_foreach(now, name, value) if (!json_equal(value, json_object_get(was, name)))
        {
            log_change(&project->log, stage, name, json_object_get(was, name), value);
            done = false;
            break;
        }
    if (done) fs_log_info(&project->log, "%s: done already, skipped (--force redoes it)", stage);
    json_decref(mark);
    json_decref(now);
    free(path);
    return done;
}

bool fs_project_done(const FsProject *project, const char *stage, unsigned stage_mask)
{
    bool done = is_done(project, stage, stage_mask);
    if (!done) fs_warnings_forget(project->out, stage);
    return done;
}

int fs_project_mark_done(const FsProject *project, const char *stage, unsigned stage_mask, FsError *err)
{
    int rc = 0;
    char *dir = fs_file_path("%s/done", project->out), *path = fs_file_path("%s/done/%s.json", project->out, stage);
    json_t *settings = current_settings(project, stage_mask);
    json_t *mark =
        settings ? json_pack("{s:s, s:s, s:O}", "stage", stage, "version", fs_version(), "settings", settings) : NULL;
    char *text = mark ? json_dumps(mark, JSON_INDENT(1)) : NULL;
    if (!dir || !path || !text) {
        rc = fs_error_memory(err);
        goto fail;
    }
    TRY(fs_file_mkdirs(dir, err));
    TRY(fs_file_write(path, text, strlen(text), err));
fail:
    json_decref(settings);
    json_decref(mark);
    free(text);
    free(dir);
    free(path);
    return rc;
}

void fs_project_unmark(const FsProject *project, const char *stage)
{
    unsigned mask = 0;
    for (size_t i = 0; i < N_STAGES; i++)
        if (strcmp(stages[i].name, stage) == 0) mask = stages[i].stage;
    for (size_t i = 0; i < N_STAGES; i++) {
        if (stages[i].stage != mask && !(stages[i].after & mask)) continue;
        char *path = fs_file_path("%s/done/%s.json", project->out, stages[i].name);
        if (path) unlink(path);
        free(path);
    }
    if (mask & (FS_STAGE_INGEST | FS_STAGE_POSES | FS_STAGE_INITIALISE)) { // no training can go on from another start
        char *checkpoint = fs_file_path("%s/checkpoint", project->out);
        if (checkpoint) fs_file_remove_tree(checkpoint);
        free(checkpoint);
    }
}

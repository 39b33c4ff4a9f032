// Done marks: OUT/done/<stage>.json holds what a stage's results follow from. A stage is done while its mark is there
// and says what would be said now; a stage that starts removes its own mark and those of the stages that read its
// results, and the checkpoint of a training that its results would feed.
#include "model/project.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "model/fingerprint.h"

#define MAX_MARK_BYTES (1 << 20)

#define INGEST FS_STAGE_INGEST
#define POSES (INGEST | FS_STAGE_POSES)
#define INITIALISE (POSES | FS_STAGE_INITIALISE)
#define TRAIN (INITIALISE | FS_STAGE_TRAIN)

// clang-format off
const ProjectStage fs_project_stages[PROJECT_STAGES] = {
    {"ingest", FS_STAGE_INGEST, 0, {NULL}},
    {"poses", FS_STAGE_POSES, INGEST, {"ingest.json", "linear"}},
    {"initialise", FS_STAGE_INITIALISE, POSES, {"views.json", "images", "sparse"}},
    {"train", FS_STAGE_TRAIN, INITIALISE, {"views.json", "images", "start"}},
    {"render", FS_STAGE_RENDER, TRAIN, {"views.json", "images", "clouds"}},
    {"evaluate", FS_STAGE_EVALUATE, TRAIN | FS_STAGE_RENDER, {NULL}}, // always measures anew
    {"export", FS_STAGE_EXPORT, TRAIN, {"views.json", "images", "clouds", "ingest.json"}},
};
// clang-format on

const ProjectStage *fs_project_stage(unsigned stage)
{
    const ProjectStage *row = fs_project_stages;
    while (row->stage != stage) row++;
    return row;
}

static char *mark_path(const FsProject *project, unsigned stage)
{
    return fs_file_path("%s/done/%s.json", project->out, fs_project_stage(stage)->name);
}

static bool is_done(FsProject *project, const ProjectStage *stage)
{
    const char *now = fs_project_fingerprint(project, stage->stage);
    if (project->set.force) return false;
    char *path = mark_path(project, stage->stage), *was = NULL, what[400];
    size_t size;
    bool done = false;
    if (path && fs_file_exists(path)) {
        done = fs_file_read(path, MAX_MARK_BYTES, &was, &size, NULL) == 0 &&
               !fs_fingerprint_differs(was, now, what, sizeof what);
        if (done)
            fs_log_info(&project->log, "%s: done already, skipped (--force redoes it)", stage->name);
        else
            fs_log_info(&project->log, "%s: done again, %s", stage->name, was ? what : "its mark cannot be read");
    }
    free(was);
    free(path);
    return done;
}

bool fs_project_done(FsProject *project, unsigned stage)
{
    project->fingerprint_stage = 0; // anew: files may have changed
    bool done = is_done(project, fs_project_stage(stage));
    if (!done) fs_warnings_forget(project->out, fs_project_stage(stage)->name);
    return done;
}

const char *fs_project_fingerprint(FsProject *project, unsigned stage)
{
    if (project->fingerprint_stage == stage && project->fingerprint) return project->fingerprint;
    free(project->fingerprint);
    project->fingerprint = fs_fingerprint_make(project, fs_project_stage(stage));
    project->fingerprint_stage = stage;
    return project->fingerprint;
}

int fs_project_check(FsProject *project, unsigned stage, const char *was, const char *path, FsError *err)
{
    char what[400];
    const char *now = fs_project_fingerprint(project, stage);
    if (!now) return fs_error_memory(err);
    if (!fs_fingerprint_differs(was, now, what, sizeof what)) return 0;
    return fs_error_set(err, FS_ERR_INPUT, "%s: %s; leave --resume to begin anew", path, what);
}

int fs_project_mark_done(FsProject *project, unsigned stage, FsError *err)
{
    int rc = 0;
    const char *name = fs_project_stage(stage)->name, *now = fs_project_fingerprint(project, stage);
    char *dir = fs_file_path("%s/done", project->out), *path = mark_path(project, stage);
    json_t *mark = json_pack("{s:s, s:s}", "stage", name, "version", fs_version());
    json_t *fingerprint = now ? json_loads(now, 0, NULL) : NULL;
    char *text = mark && json_object_update(mark, fingerprint) == 0 ? json_dumps(mark, JSON_INDENT(1)) : NULL;
    if (!dir || !path || !text) {
        rc = fs_error_memory(err);
        goto fail;
    }
    if (fs_error_memory_failures() != project->memory_failures) { // something may have been left out for it
        rc = fs_error_memory(err);
        goto fail;
    }
    TRY(fs_file_mkdirs(dir, err));
    TRY(fs_file_sync_names(err));
    TRY(fs_file_write(path, text, strlen(text), err));
    TRY(fs_file_sync_names(err));
fail:
    json_decref(fingerprint);
    json_decref(mark);
    free(text);
    free(dir);
    free(path);
    return rc;
}

void fs_project_unmark(const FsProject *project, unsigned stage)
{
    for (int i = 0; i < PROJECT_STAGES; i++) {
        const ProjectStage *row = &fs_project_stages[i];
        if (row->stage != stage && !(row->after & stage)) continue;
        char *path = mark_path(project, row->stage);
        if (path) fs_file_remove(path);
        free(path);
    }
    fs_file_sync_names(NULL); // before results that they are not about
    if (stage & INITIALISE) { // no training can go on from another start
        char *checkpoint = fs_file_path("%s/checkpoint", project->out);
        if (checkpoint) fs_file_remove_tree(checkpoint);
        free(checkpoint);
    }
}

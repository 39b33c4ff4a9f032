// Done marks: OUT/done/<stage>.json holds what a stage's results follow from. A stage is done while its mark is there
// and says what would be said now; a stage that starts removes its own mark and those of the stages that read its
// results, the checkpoint of a training that its results would feed, and the figures of what they fed.
#include "model/project.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "model/fingerprint.h"
#include "model/outputs.h"

#define MAX_MARK_BYTES (1 << 20)

#define INGEST FS_STAGE_INGEST
#define POSES (INGEST | FS_STAGE_POSES)
#define INITIALISE (POSES | FS_STAGE_INITIALISE)
#define TRAIN (INITIALISE | FS_STAGE_TRAIN)
#define COUNTED (FS_STAGE_RENDER | FS_STAGE_EXPORT) // their marks say how many files they left

// clang-format off
const ProjectStage fs_project_stages[PROJECT_STAGES] = {
    {"ingest", FS_STAGE_INGEST, 0, {NULL},
     {"ingest.json", "originals.json", "linear/%.tif", "linear/%_mask.png", "linear/features/%.png",
      "linear/features_masks/%.png.png", "linear/fine/%.tif", "linear/fine/%_mask.png"}},
    {"poses", FS_STAGE_POSES, INGEST, {"ingest.json", "linear"},
     {"views.json", "images/%.tif", "images/%_mask.png", "sparse/*.txt", "sparse/*.bin"}},
    {"initialise", FS_STAGE_INITIALISE, POSES, {"views.json", "images", "sparse"},
     {"start/&.ply", "start/field.bin", "start/model.json", "start/lamps.ply", "start/transmitted.ply", "start/transmitted_surface.ply",
      "start/reflected.ply", "start/reflected_surface.ply"}},
    {"train", FS_STAGE_TRAIN, INITIALISE, {"views.json", "images", "start"},
     {"=clouds/&.ply", "=clouds/field.bin", "=clouds/model.json", "=clouds/photos.json", "=clouds/veil.tif", "log.jsonl", "progress/*.png", "checkpoint.old/*", "checkpoint.new/*",
      "checkpoint/*"}}, // last: their files stand under its name (owned.c), and lines of files that are gone go with it
    {"render", FS_STAGE_RENDER, TRAIN, {"views.json", "images", "clouds"},
     {"=renders/*/%.png", "=renders/*/%.tif", "=renders/rendered_from.json", "=sheet.png", "=video/*.mp4"}},
    {"evaluate", FS_STAGE_EVALUATE, TRAIN | FS_STAGE_RENDER, {NULL}, {"=evaluate.json"}}, // always measures anew
    {"export", FS_STAGE_EXPORT, TRAIN, {"views.json", "images", "clouds", "ingest.json"},
     {"export/&.ply", "export/&.splat", "export/&.spz", "export/&.v2.spz", "export/&.sog",
      "export/&.compressed.ply", "export/&.points.ply", "export/&.glb", "export/&.mesh.ply", "export/room.*", "export/dataset/images/%.png", "export/dataset/masks/%.png.png", "export/dataset/pairs.txt",
      "export/dataset/sparse/0/*.bin", "export/photos/%.jpg", "export/photos/%.tif", "export/photos/%.dng"}},
};
// clang-format on
static const char *const shared_output[] = {"=index.html", "=report/*.jpg", "=report/scene.js", "=warnings/*.txt",
                                            "=done/*.json"};
#define N_SHARED ((int)(sizeof shared_output / sizeof *shared_output))

static const ProjectStage *row_of(unsigned stage)
{
    const ProjectStage *row = fs_project_stages;
    while (row->stage != stage) row++;
    return row;
}

int fs_project_lock(FsProject *project, FsError *err)
{
    if (fs_owned_lock(project->out, &project->lock)) return 0;
    return fs_error_input(err,
                          "%s: another flashsplat works on it: wait until that is done, or let the results go to "
                          "another folder",
                          project->out);
}

bool fs_project_is_read_only(const FsProject *project)
{
    return fs_file_is_read_only(project->out) ||
           fs_file_is_read_only(fs_file_at("%s/" FS_OWNED_DIR, project->out).text);
}

static FilePath mark_path(const FsProject *project, unsigned stage)
{
    return fs_file_at("%s/done/%s.json", project->out, row_of(stage)->name);
}

static void say_done(const FsProject *project, const char *stage, const char *mark)
{
    json_t *root = json_loads(mark, 0, NULL);
    const char *version = json_string_value(json_object_get(root, "version"));
    if (version && strcmp(version, fs_version()) != 0)
        fs_log_warn(&project->log, "%s: done already by version %.40s (this is %s), skipped (--force redoes it)", stage,
                    version, fs_version());
    else
        fs_log_info(&project->log, "%s: done already, skipped (--force redoes it)", stage);
    json_decref(root);
}

// FINGERPRINT_* by which a stage's mark differs from what it would say now, and how. was: the mark, which the caller
// frees; NULL: none that can be read.
static unsigned mark_differs(FsProject *project, const ProjectStage *stage, char **was, char what[400])
{
    size_t size;
    const char *now = fs_project_fingerprint(project, stage->stage);
    *was = NULL;
    if (fs_file_read(mark_path(project, stage->stage).text, MAX_MARK_BYTES, was, &size, NULL) == 0)
        return fs_fingerprint_differs(*was, now, what, 400);
    snprintf(what, 400, "its mark cannot be read");
    return FINGERPRINT_SETTINGS | FINGERPRINT_INPUTS;
}

// What people look at, and the clouds, may have been removed to have it made again.
static bool has_folder(const FsProject *project, const ProjectStage *stage)
{
    const char *pattern = stage->output[0] + (*stage->output[0] == '=');
    FilePath first = fs_file_at("%s/%.*s", project->out, (int)strcspn(pattern, "/"), pattern);
    return !((stage->after | stage->stage) & FS_STAGE_TRAIN) || fs_file_exists(first.text);
}

// Whether an export goes beside one of the same clouds.
static bool adds(FsProject *project, const ProjectStage *stage)
{
    char what[400], *was;
    if (stage->stage != FS_STAGE_EXPORT || project->set.force || !has_folder(project, stage)) return false;
    bool same = !(mark_differs(project, stage, &was, what) & FINGERPRINT_INPUTS);
    free(was);
    return same;
}

// Single files may, too, but of a training, whose pictures and checkpoints nobody needs.
static bool is_whole(const FsProject *project, const ProjectStage *stage, const char *mark)
{
    if (!has_folder(project, stage)) return false;
    if (!(stage->stage & COUNTED)) return true;
    json_t *was = mark ? json_loads(mark, 0, NULL) : NULL;
    bool whole = fs_outputs_are_there(project->out, stage->output, json_object_get(was, "files"));
    json_decref(was);
    return whole;
}

static bool is_done(FsProject *project, const ProjectStage *stage, bool quiet)
{
    char what[400], *was;
    project->fingerprint_stage = 0; // anew: files may have changed
    unsigned differs = mark_differs(project, stage, &was, what);
    bool done = !project->set.force && !differs && is_whole(project, stage, was);
    bool goes_on = stage->stage == FS_STAGE_TRAIN && project->set.resume && fs_project_has_checkpoint(project->out);
    if (done && !quiet)
        say_done(project, stage->name, was);
    else if (!quiet && !project->set.force && !goes_on && fs_file_exists(mark_path(project, stage->stage).text))
        fs_log_info(&project->log, "%s: done %s, %s", stage->name,
                    differs && adds(project, stage) ? "beside what is there" : "again",
                    differs                      ? what
                    : has_folder(project, stage) ? "some of what it wrote is gone"
                                                 : "what it wrote is gone");
    free(was);
    return done;
}

bool fs_project_is_done(FsProject *project, unsigned stage)
{
    return is_done(project, row_of(stage), true);
}

bool fs_project_done(FsProject *project, unsigned stage)
{
    bool done = is_done(project, row_of(stage), false);
    if (!done) fs_warnings_renew(project->warnings);
    return done;
}

json_t *fs_project_mark(const char *out, const char *stage)
{
    json_t *mark;
    fs_json_file_read(fs_file_at("%s/done/%s.json", out, stage).text, MAX_MARK_BYTES, &mark, NULL);
    return mark;
}

bool fs_project_done_with(const FsProject *project, unsigned stage, const char *option, const char *value)
{
    json_t *root = fs_project_mark(project->out, row_of(stage)->name);
    const char *was = json_string_value(json_object_get(json_object_get(root, "settings"), option));
    bool same = was && strcmp(was, value) == 0;
    json_decref(root);
    return same;
}

const char *fs_project_fingerprint(FsProject *project, unsigned stage)
{
    if (project->fingerprint_stage == stage && project->fingerprint) return project->fingerprint;
    free(project->fingerprint);
    project->fingerprint = fs_fingerprint_make(project, row_of(stage));
    project->fingerprint_stage = stage;
    return project->fingerprint;
}

static int refuse_to_resume(const char *path, const char *what, FsError *err)
{
    return fs_error_input(err, "%s: %s; run with what it was, or without --resume to begin anew", path, what);
}

int fs_project_check(FsProject *project, unsigned stage, const char *was, const char *path, FsError *err)
{
    char what[400];
    const char *now = fs_project_fingerprint(project, stage);
    if (!now) return fs_error_memory(err);
    return fs_fingerprint_differs(was, now, what, sizeof what) ? refuse_to_resume(path, what, err) : 0;
}

bool fs_project_has_checkpoint(const char *out)
{
    return fs_file_exists(fs_file_at("%s/checkpoint", out).text) ||
           fs_file_exists(fs_file_at("%s/checkpoint.old", out).text);
}

// A checkpoint that is to be gone on from does not go because a stage before the training is done with something else.
static int check_resume(FsProject *project, const ProjectStage *stage, FsError *err)
{
    char what[400], *was;
    if (!(stage->stage & INITIALISE) || !project->set.resume || project->set.force) return 0;
    if (!fs_project_has_checkpoint(project->out) || !fs_file_exists(mark_path(project, stage->stage).text)) return 0;
    unsigned differs = mark_differs(project, stage, &was, what);
    free(was);
    return differs ? refuse_to_resume(fs_file_at("%s/checkpoint", project->out).text, what, err) : 0;
}

// `was`: settings and inputs of a training.
static bool take_steps(FsProject *project, const json_t *was)
{
    Settings *set = &project->set;
    const json_t *settings = json_object_get(was, "settings");
    int wanted = set->steps, steps = (int)json_integer_value(json_object_get(settings, "steps"));
    if (steps < 1 || json_number_value(json_object_get(settings, "minutes")) != set->minutes) return false;
    char what[400], *text = json_dumps(was, 0);
    set->steps = steps;
    project->fingerprint_stage = 0;
    const char *now = fs_project_fingerprint(project, FS_STAGE_TRAIN);
    bool same = !fs_fingerprint_differs(text, now, what, sizeof what);
    free(text);
    if (!same) set->steps = wanted;
    project->fingerprint_stage = 0;
    return same;
}

bool fs_project_take_steps(FsProject *project)
{
    static const char *const place[] = {"done/train.json", "checkpoint/state.json", "checkpoint.old/state.json"};
    bool taken = false;
    for (int i = 0; i < 3 && !taken; i++) {
        json_t *root = NULL;
        if (i ? project->set.resume : !project->set.force)
            fs_json_file_read(fs_file_at("%s/%s", project->out, place[i]).text, MAX_MARK_BYTES, &root, NULL);
        const char *made_from = json_string_value(json_object_get(root, "made_from")); // a checkpoint's
        json_t *was = made_from ? json_loads(made_from, 0, NULL) : json_incref(root);
        taken = take_steps(project, was);
        json_decref(was);
        json_decref(root);
    }
    return taken;
}

// whole: all is there that the settings ask for. Else what is there is of these inputs, and that is all that is told.
static int write_mark(FsProject *project, unsigned stage, bool whole, FsError *err)
{
    int rc = 0;
    const ProjectStage *row = row_of(stage);
    const char *now = fs_project_fingerprint(project, stage);
    json_t *mark = json_pack("{s:s, s:s}", "stage", row->name, "version", fs_version());
    json_t *fingerprint = now ? json_loads(now, 0, NULL) : NULL;
    if (!mark || json_object_update(mark, fingerprint) < 0) TRY(fs_error_memory(err));
    if (!whole && json_object_set_new(mark, "settings", json_object()) < 0) TRY(fs_error_memory(err));
    if (whole && (row->stage & COUNTED)) {
        json_t *files = fs_outputs_count(project->out, row->output, err);
        if (!files) TRY(FS_ERR_MEMORY);
        if (json_object_set_new(mark, "files", files) < 0) TRY(fs_error_memory(err));
    }
    if (fs_error_memory_failures() != project->memory_failures) // something may have been left out for it
        TRY(fs_error_memory(err));
    TRY(fs_file_mkdirs(fs_file_at("%s/done", project->out).text, err));
    TRY(fs_file_sync_names(err));
    TRY(fs_json_file_write(mark_path(project, stage).text, json_incref(mark), JSON_INDENT(1), err));
    TRY(fs_file_sync_names(err));
fail:
    json_decref(fingerprint);
    json_decref(mark);
    return rc;
}

int fs_project_mark_done(FsProject *project, unsigned stage, FsError *err)
{
    return write_mark(project, stage, true, err);
}

static void remove_in(const FsProject *project, const char *name)
{
    fs_owned_remove(fs_file_at("%s/%s", project->out, name).text);
}

void fs_project_unmark(const FsProject *project, unsigned stage)
{
    for (int i = 0; i < PROJECT_STAGES; i++) {
        const ProjectStage *row = &fs_project_stages[i];
        if (row->stage == stage || (row->after & stage)) fs_owned_remove(mark_path(project, row->stage).text);
    }
    fs_file_sync_names(NULL);                               // before results that they are not about
    if (stage & TRAIN) remove_in(project, "evaluate.json"); // figures of what will be gone
    if (!(stage & INITIALISE)) return;
    remove_in(project, "checkpoint.old"); // no training can go on from another start
    remove_in(project, "checkpoint.new");
    remove_in(project, "checkpoint");
}

// ---- before a stage touches anything ----

// What earlier versions left would be taken for the user's, file by file.
static int check_marks(const FsProject *project, FsError *err)
{
    for (int i = 0; i < PROJECT_STAGES; i++) {
        FilePath path = mark_path(project, fs_project_stages[i].stage);
        if (fs_owned_check(path.text, NULL) < 0)
            return fs_error_input(err,
                                  "%s: not a mark that this version wrote: the results of other versions are left as "
                                  "they are; let these go to another folder",
                                  path.text);
    }
    return 0;
}

// Whether a name below OUT is an output, or in the same folder of OUT.
static bool is_beside(const char *name, const char *output)
{
    output += *output == '=';
    size_t n = strcspn(output, "/");
    return strncmp(name, output, n) == 0 && (!name[n] || name[n] == '/');
}

int fs_project_check_input(const FsProject *project, const char *path, FsError *err)
{
    char *input = realpath(path, NULL), *out = realpath(project->out, NULL);
    int rc = input ? 0 : fs_error_input(err, "%s: no such file or folder", path);
    size_t n = out ? strlen(out) : 0;
    if (!out && errno == ENOMEM) fs_error_memory(NULL);
    if (input && n && strncmp(input, out, n) == 0 && input[n] == '/') {
        const char *name = input + n + 1;
        bool beside = is_beside(name, FS_OWNED_DIR);
        for (int i = 0; i < N_SHARED; i++) beside |= is_beside(name, shared_output[i]);
        for (int i = 0; i < PROJECT_STAGES; i++)
            for (int k = 0; k < PROJECT_OUTPUTS && fs_project_stages[i].output[k]; k++)
                beside |= is_beside(name, fs_project_stages[i].output[k]);
        if (beside)
            rc = fs_error_input(err, "%s: is where results go (%s/%.*s): name another folder for them", path,
                                project->out, (int)strcspn(name, "/"), name);
    }
    free(input);
    free(out);
    return rc;
}

int fs_project_check_output(const FsProject *project, const char *path, FsError *err)
{
    FilePath whole = fs_file_whole(path), out = fs_file_whole(project->out);
    size_t n = strlen(out.text);
    if (strncmp(whole.text, out.text, n) != 0 || whole.text[n] != '/') return 0;
    const char *name = whole.text + n + 1;
    bool beside = is_beside(name, FS_OWNED_DIR);
    for (int i = 0; i < PROJECT_STAGES; i++)
        for (int k = 0; k < PROJECT_OUTPUTS && fs_project_stages[i].output[k]; k++)
            beside |= fs_project_stages[i].stage != FS_STAGE_RENDER && is_beside(name, fs_project_stages[i].output[k]);
    if (!beside) return 0;
    return fs_error_input(err, "%s: is where other results go (%s/%.*s): name another folder for the pictures", path,
                          project->out, (int)strcspn(name, "/"), name);
}

int fs_project_missing(const char *out, unsigned stage, const char *name, FsError *err)
{
    const char *made = row_of(stage)->name, *photos = stage == FS_STAGE_INGEST ? "PHOTOS -o " : "";
    if (!fs_file_exists(fs_file_at("%s/done/%s.json", out, made).text))
        return fs_error_input(err, "%s/%s: is not there: first run `flashsplat %s %s%s`", out, name, made, photos, out);
    return fs_error_input(err,
                          "%s/%s: is missing: `flashsplat %s %s%s --force` makes it again, with the options that it "
                          "was made with",
                          out, name, made, photos, out);
}

static int check_plan(const FsProject *project, unsigned stages, const OutputNames *names, FsError *err)
{
    MUST(check_marks(project, err));
    if ((stages & FS_STAGE_POSES) && *project->set.poses)
        MUST(fs_project_check_input(project, project->set.poses, err));
    const char *const clouds[] = {project->set.points, project->set.flash_points, project->set.noflash_points};
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++)
        if ((stages & FS_STAGE_INITIALISE) && *clouds[i]) MUST(fs_project_check_input(project, clouds[i], err));
    for (int i = 0; i < N_SHARED; i++) MUST(fs_outputs_check(project->out, shared_output[i], names, err));
    for (int i = 0; i < PROJECT_STAGES; i++)
        for (int k = 0; k < PROJECT_OUTPUTS && fs_project_stages[i].output[k]; k++)
            if (fs_project_stages[i].stage & stages)
                MUST(fs_outputs_check(project->out, fs_project_stages[i].output[k], names, err));
    return 0;
}

// What the last run left; not what a training is to go on from.
static void clear(const FsProject *project, const ProjectStage *stage)
{
    bool goes_on = stage->stage == FS_STAGE_TRAIN && project->set.resume && fs_project_has_checkpoint(project->out);
    for (int k = 0; k < PROJECT_OUTPUTS && stage->output[k] && !goes_on; k++) {
        char *name = strndup(stage->output[k], strcspn(stage->output[k], "/"));
        if (!name) fs_error_memory(NULL);
        if (name && *name != '=') remove_in(project, name);
        free(name);
    }
}

// A stage was not done since one that it follows from was, though there is something of it.
static bool is_stale(const FsProject *project, const ProjectStage *row, const char **since)
{
    bool there = false;
    *since = NULL;
    for (int k = 0; k < PROJECT_OUTPUTS && row->output[k]; k++) {
        const char *name = row->output[k] + (*row->output[k] == '=');
        there |= !strpbrk(name, "%&*") && fs_file_exists(fs_file_at("%s/%s", project->out, name).text);
    }
    if (!there || fs_file_exists(mark_path(project, row->stage).text)) return false;
    for (int k = 0; k < PROJECT_STAGES; k++)
        if ((row->after & fs_project_stages[k].stage) &&
            fs_file_exists(mark_path(project, fs_project_stages[k].stage).text))
            *since = fs_project_stages[k].name;
    return *since != NULL;
}

int fs_project_check_earlier(const FsProject *project, unsigned stage, FsError *err)
{
    const char *since;
    for (int i = 0; i < PROJECT_STAGES; i++) {
        const ProjectStage *row = &fs_project_stages[i];
        if ((row_of(stage)->after & row->stage & TRAIN) && is_stale(project, row, &since))
            return fs_error_input(err,
                                  "%s: %s was not done since %s was: first run `flashsplat %s %s`, or all with "
                                  "`flashsplat run`",
                                  project->out, row->name, since, row->name, project->out);
    }
    return 0;
}

int fs_project_begin(FsProject *project, unsigned stage, const char *const *view, int n, FsError *err)
{
    OutputNames names = {.view = view, .n = n};
    int rc = fs_project_check_earlier(project, stage, err);
    if (rc == 0) rc = check_resume(project, row_of(stage), err);
    if (rc == 0) rc = fs_owned_open(project->out, "project", err);
    if (rc == 0 && !view) rc = fs_outputs_names(&names, project->out, err);
    unsigned from_here = stage | (project->planned & ~(stage - 1)); // the bits are in the order of the stages
    if (rc == 0) rc = check_plan(project, from_here, &names, err);
    if (rc == 0) fs_warnings_settle(project->warnings);
    project->worked |= rc == 0;
    if (rc == 0 && adds(project, row_of(stage))) {
        rc = write_mark(project, stage, false, err);
    } else if (rc == 0) {
        fs_project_unmark(project, stage);
        clear(project, row_of(stage));
    }
    fs_outputs_free(&names);
    return rc;
}

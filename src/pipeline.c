// The public calls: a project folder, its stages in order, and the programs beside them.
#include "flashsplat.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/owned.h"
#include "bench/bench.h"
#include "check/check.h"
#include "estimate.h"
#include "evaluate/evaluate.h"
#include "export/export.h"
#include "info/info.h"
#include "ingest/ingest.h"
#include "initialise/initialise.h"
#include "model/cameras_file.h"
#include "model/project.h"
#include "model/scene_folder.h"
#include "pair/pair.h"
#include "poses/poses.h"
#include "render/render.h"
#include "report/report.h"
#include "synth/synth.h"
#include "train/train.h"
#include "view/view.h"

static int need(const char *path, const char *what, FsError *err)
{
    return path && *path ? 0 : fs_error_set(err, FS_ERR_USAGE, "%s has no name", what);
}

int fs_project_open(FsProject **project, const char *out, const FsSettings *settings, const FsCallbacks *callbacks,
                    FsError *err)
{
    *project = NULL;
    MUST(need(out, "the output folder", err));
    MUST(fs_settings_check(settings, err));
    int rc = 0;
    FsProject *p = calloc(1, sizeof *p);
    if (!p) return fs_error_memory(err);
    p->out = strdup(out);
    TRY(fs_settings_copy(&p->set, settings, err));
    p->set.resume &= !p->set.force; // anew is anew
    if (!p->out) TRY(fs_error_memory(err));
    for (size_t n = strlen(p->out); n > 1 && p->out[n - 1] == '/'; n--) p->out[n - 1] = 0;
    p->made_out = fs_file_missing(p->out);
    TRY(fs_owned_check_place(p->out, err));
    TRY(fs_file_mkdirs(p->out, err));
    fs_owned_open(p->out, "project", NULL); // what is only read need not be ours; a stage that writes asks again
    TRY(fs_warnings_new(&p->warnings, p->out, callbacks, &p->log, err));
    *project = p;
    return 0;
fail:
    fs_project_close(p);
    return rc;
}

void fs_project_close(FsProject *project)
{
    if (!project) return;
    if (project->out) fs_owned_leave(project->out, project->made_out, &project->lock);
    fs_lock_release(&project->lock);
    fs_warnings_free(project->warnings);
    fs_settings_clear(&project->set);
    free(project->fingerprint);
    free(project->out);
    free(project);
}

static unsigned begin_stage(FsProject *project, const char *stage)
{
    fs_warnings_stage(project->warnings, stage);
    return project->memory_failures = fs_memory_begin();
}

int fs_ingest(FsProject *project, const char *photos, FsError *err)
{
    MUST(need(photos, "the folder of photos", err));
    MUST(fs_project_lock(project, err));
    unsigned failures = begin_stage(project, "ingest");
    return fs_memory_end(failures, fs_ingest_run(project, photos, err), err);
}

static int stage(FsProject *project, const char *name, int (*run)(FsProject *, FsError *), FsError *err)
{
    unsigned failures = begin_stage(project, name);
    return fs_memory_end(failures, run(project, err), err);
}

int fs_poses(FsProject *project, FsError *err)
{
    MUST(fs_project_lock(project, err));
    return stage(project, "poses", fs_poses_run, err);
}

int fs_initialise(FsProject *project, FsError *err)
{
    MUST(fs_project_lock(project, err));
    return stage(project, "initialise", fs_initialise_run, err);
}

// begin: of all that the setting minutes is for.
static int train_within(FsProject *project, double begin, FsError *err)
{
    MUST(fs_project_lock(project, err));
    unsigned failures = begin_stage(project, "train");
    FsError late = {0};
    int steps = project->set.steps, rc = fs_estimate_steps(project, begin, &late, err);
    if (rc == 0) rc = fs_train_run(project, err);
    if (rc == 0 && late.code) fs_log_warn(&project->log, "%s", late.message); // after training let go of old warnings
    project->set.steps = steps;
    return fs_memory_end(failures, rc, err);
}

int fs_train(FsProject *project, FsError *err)
{
    return train_within(project, fs_clock_seconds(), err);
}

// After a stage that ran alone: the page is brought up to date where there is one.
static int refresh_report(FsProject *project, FsError *err)
{
    unsigned failures = fs_memory_begin();
    bool there = fs_owned_is_result(fs_file_at("%s/index.html", project->out).text);
    return fs_memory_end(failures, there ? stage(project, NULL, fs_report_run, err) : 0, err);
}

int fs_render(FsProject *project, FsError *err)
{
    if (!*project->set.output) MUST(fs_project_lock(project, err));
    int rc = stage(project, *project->set.output ? NULL : "render", fs_render_run, err);
    return rc < 0 || *project->set.output ? rc : refresh_report(project, err); // elsewhere: nothing to bring up to date
}

int fs_evaluate(FsProject *project, const char *truth, FsError *err)
{
    MUST(need(truth, "the folder of the truth", err));
    MUST(fs_project_lock(project, err));
    unsigned failures = begin_stage(project, "evaluate");
    fs_warnings_renew(project->warnings); // it always measures anew
    int rc = fs_memory_end(failures, fs_evaluate_run(project, truth, err), err);
    return rc < 0 ? rc : refresh_report(project, err);
}

int fs_export(FsProject *project, FsError *err)
{
    MUST(fs_project_lock(project, err));
    int rc = stage(project, "export", fs_export_run, err);
    return rc < 0 ? rc : refresh_report(project, err);
}

// Which views are to be rendered, in hours.
static int check_cameras(const char *path, FsError *err)
{
    CamerasFile file;
    int rc = fs_cameras_file_read(path, &file, err);
    fs_cameras_file_free(&file);
    return rc;
}

// What the stages still to run are told to read is there, before hours go by. What was read may be gone.
static int check_named(const FsProject *project, FsError *err)
{
    const Settings *set = &project->set;
    CpuLevel cpu;
    const struct {
        const char *option, *path;
        unsigned stage;
    } named[] = {{"flash-list", set->flash_list, FS_STAGE_INGEST},
                 {"masks", set->masks, FS_STAGE_INGEST},
                 {"poses", set->poses, FS_STAGE_POSES},
                 {"points", set->points, FS_STAGE_INITIALISE},
                 {"flash-points", set->flash_points, FS_STAGE_INITIALISE},
                 {"noflash-points", set->noflash_points, FS_STAGE_INITIALISE},
                 {"cameras", set->cameras, FS_STAGE_RENDER},
                 {"originals", set->originals, FS_STAGE_EXPORT}};
    for (size_t i = 0; i < sizeof named / sizeof *named; i++) {
        bool done = fs_project_done_with(project, named[i].stage, named[i].option, named[i].path);
        if (*named[i].path && !done && !fs_file_exists(named[i].path))
            return fs_error_input(err, "%s: no such file or folder, or it cannot be read; --%s names it", named[i].path,
                                  named[i].option);
        if (*named[i].path && !done && named[i].path == set->cameras) MUST(check_cameras(set->cameras, err));
    }
    MUST(fs_poses_check(project, err));
    MUST(fs_initialise_check(set, err));
    MUST(fs_export_check(set, err));
    return fs_cpu_choose(set->cpu, &cpu, err);
}

int fs_run(FsProject *project, const char *photos, FsError *err)
{
    int rc;
    double begin = fs_clock_seconds();
    ReportLive *live = NULL;
    FsError why = {0};
    if (!err) err = &why; // the page says it
    MUST(need(photos, "the folder of photos", err));
    project->planned = FS_STAGE_ALL & ~(unsigned)FS_STAGE_EVALUATE;
    TRY(fs_project_lock(project, err));
    unsigned failures = fs_memory_begin();
    TRY(fs_memory_end(failures, fs_scene_folder_take(&project->set, photos, &project->log, err), err));
    TRY(check_named(project, err));
    TRY(fs_report_live_begin(&live, project, err));
    TRY(fs_estimate_run(project, photos, begin, err));
    TRY(fs_ingest(project, photos, err));
    TRY(fs_poses(project, err));
    TRY(fs_initialise(project, err));
    TRY(train_within(project, begin, err));
    TRY(stage(project, "render", fs_render_run, err));
    TRY(stage(project, "export", fs_export_run, err));
    TRY(stage(project, NULL, fs_report_run, err));
    fs_info_results(project->out, &project->log);
fail:
    fs_report_live_end(live, rc < 0 ? err->message : NULL);
    project->planned = 0;
    return rc;
}

int fs_synth(const char *out, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    MUST(need(out, "the output folder", err));
    unsigned failures = fs_memory_begin();
    return fs_memory_end(failures, fs_synth_run(out, settings, callbacks, err), err);
}

int fs_pair(const char *flash, const char *noflash, const char *out, const FsSettings *settings,
            const FsCallbacks *callbacks, FsError *err)
{
    MUST(need(flash, "the flash photo", err));
    MUST(need(noflash, "the photo without flash", err));
    MUST(need(out, "the output file", err));
    unsigned failures = fs_memory_begin();
    return fs_memory_end(failures, fs_pair_run(flash, noflash, out, settings, callbacks, err), err);
}

int fs_bench(const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    unsigned failures = fs_memory_begin();
    return fs_memory_end(failures, fs_bench_run(settings, callbacks, err), err);
}

int fs_check(const char *photos, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    MUST(need(photos, "the folder of photos", err));
    unsigned failures = fs_memory_begin();
    int rc = fs_check_run(photos, settings, callbacks, err);
    return rc < 0 ? rc : fs_memory_end(failures, 0, err) < 0 ? FS_ERR_MEMORY : rc;
}

int fs_info(const char *path, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    (void)settings;
    MUST(need(path, "what to describe", err));
    unsigned failures = fs_memory_begin();
    return fs_memory_end(failures, fs_info_run(path, callbacks, err), err);
}

int fs_view(const char *out, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    MUST(need(out, "the output folder", err));
    unsigned failures = fs_memory_begin();
    return fs_memory_end(failures, fs_view_run(out, settings, callbacks, err), err);
}

const char *fs_version(void)
{
    return FS_VERSION;
}

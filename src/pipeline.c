// The public calls: a project folder, its stages in order, and the programs beside them.
#include "flashsplat.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "bench/bench.h"
#include "evaluate/evaluate.h"
#include "export/export.h"
#include "info/info.h"
#include "ingest/ingest.h"
#include "initialise/initialise.h"
#include "model/project.h"
#include "pair/pair.h"
#include "poses/poses.h"
#include "synth/synth.h"
#include "render/render.h"
#include "report/report.h"
#include "train/train.h"

int fs_project_open(FsProject **project, const char *out, const FsSettings *settings, const FsCallbacks *callbacks,
                    FsError *err)
{
    *project = NULL;
    if (!out || !*out) return fs_error_set(err, FS_ERR_USAGE, "the output folder has no name");
    int rc = 0;
    FsProject *p = calloc(1, sizeof *p);
    if (!p) return fs_error_memory(err);
    p->out = strdup(out);
    fs_settings_copy(&p->set, settings);
    if (!p->out) {
        rc = fs_error_memory(err);
        goto fail;
    }
    for (size_t n = strlen(p->out); n > 1 && p->out[n - 1] == '/'; n--) p->out[n - 1] = 0;
    TRY(fs_file_mkdirs(p->out, err));
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
    fs_warnings_free(project->warnings);
    fs_settings_clear(&project->set);
    free(project->fingerprint);
    free(project->out);
    free(project);
}

int fs_ingest(FsProject *project, const char *photos, FsError *err)
{
    fs_warnings_stage(project->warnings, "ingest");
    return fs_ingest_run(project, photos, err);
}

int fs_poses(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, "poses");
    return fs_poses_run(project, err);
}

int fs_initialise(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, "initialise");
    return fs_initialise_run(project, err);
}

int fs_train(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, "train");
    return fs_train_run(project, err);
}

static int render(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, "render");
    return fs_render_run(project, err);
}

static int export(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, "export");
    return fs_export_run(project, err);
}

static int report(FsProject *project, FsError *err)
{
    fs_warnings_stage(project->warnings, NULL);
    return fs_report_run(project, err);
}

// After a stage that ran alone: the page is brought up to date where there is one.
static int refresh_report(FsProject *project, FsError *err)
{
    char *index = fs_file_path("%s/index.html", project->out);
    int rc = index && fs_file_exists(index) ? report(project, err) : 0;
    free(index);
    return rc;
}

int fs_render(FsProject *project, FsError *err)
{
    int rc = render(project, err);
    return rc < 0 ? rc : refresh_report(project, err);
}

int fs_evaluate(FsProject *project, const char *truth, FsError *err)
{
    fs_warnings_stage(project->warnings, "evaluate");
    fs_warnings_forget(project->out, "evaluate"); // it always measures anew
    int rc = fs_evaluate_run(project, truth, err);
    return rc < 0 ? rc : refresh_report(project, err);
}

int fs_export(FsProject *project, FsError *err)
{
    int rc = export(project, err);
    return rc < 0 ? rc : refresh_report(project, err);
}

int fs_run(FsProject *project, const char *photos, FsError *err)
{
    int rc;
    TRY(fs_ingest(project, photos, err));
    TRY(fs_poses(project, err));
    TRY(fs_initialise(project, err));
    TRY(fs_train(project, err));
    TRY(render(project, err));
    TRY(export(project, err));
    TRY(report(project, err));
    fs_info_results(project->out, &project->log);
fail:
    return rc;
}

int fs_synth(const char *out, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    static const FsCallbacks none;
    return fs_synth_run(out, settings, callbacks ? callbacks : &none, err);
}

int fs_pair(const char *flash, const char *noflash, const char *out, const FsSettings *settings,
            const FsCallbacks *callbacks, FsError *err)
{
    static const FsCallbacks none;
    return fs_pair_run(flash, noflash, out, settings, callbacks ? callbacks : &none, err);
}

int fs_bench(const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    const Log none = {0};
    return fs_bench_run(settings, callbacks ? callbacks : &none, err);
}

int fs_info(const char *path, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err)
{
    (void)settings;
    return fs_info_run(path, callbacks, err);
}

const char *fs_version(void)
{
    return FS_VERSION;
}

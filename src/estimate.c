#include "estimate.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"
#include "export/export.h"
#include "ingest/ingest.h"
#include "initialise/initialise.h"
#include "poses/poses.h"
#include "train/train.h"

// What other stages take, in steps of training of a fixed size by scalar kernels (fs_train_reference; these stages
// hardly have wider ones), measured beside them on the shared scenes and made captures, and bytes.
#define INITIALISE_STEPS 16.4  // a photo of INITIALISE_PIXELS
#define INITIALISE_PIXELS 6e4  // of the photos it works on
#define INITIALISE_PLAIN 0.05  // share of that where it does not look for surfaces
#define INITIALISE_BYTES 110.0 // a pixel of these
#define POSES_STEPS 80e-6      // a pixel of a picture: its features and points at known poses
#define POSES_BYTES 4.0        // a pixel of a picture, of all photos: features
#define COLMAP_BYTES 520.0     // a pixel of a picture, by each thread of COLMAP
#define COLMAP_STEPS 6.5       // a photo, on one thread: its pose by COLMAP, up to a hundred photos
#define COLMAP_MATCHES 24e-6   // a pixel of a picture: what more features cost there
#define WRITE_STEPS 20e-6      // a pixel of a view: its layers as files
#define PROGRAM_BYTES 3e7
enum { LEAST_STEPS = 200 }; // of a run that is worth a trial

typedef struct Estimate {
    RunSize size;
    RunCost ingest, poses, initialise, train, render, export;
    int steps;
    unsigned done; // stages that cost nothing any more
} Estimate;

static double initialise_pixels(const RunSize *size)
{
    return fmin((double)size->width * size->height, INITIALISE_PIXELS);
}

static double threads_of(const FsProject *project)
{
    return project->set.threads > 0 ? project->set.threads : (double)sysconf(_SC_NPROCESSORS_ONLN);
}

static double find_bytes(const FsProject *project, Estimate *e)
{
    const RunSize *size = &e->size;
    e->train.bytes = fs_train_bytes(&project->set, size);
    e->initialise.bytes = PROGRAM_BYTES + INITIALISE_BYTES * size->photos * initialise_pixels(size);
    e->poses.bytes = (POSES_BYTES * size->photos + COLMAP_BYTES * threads_of(project)) * size->picture_pixels;
    double first = fmax(fmax(e->ingest.bytes, e->poses.bytes), e->initialise.bytes);
    return fmax(first, fmax(e->train.bytes, PROGRAM_BYTES + e->export.bytes));
}

// Of --clean, before the time of its renders is known.
static int find_export(const FsProject *project, const char *photos, Estimate *e, FsError *err)
{
    FsError why = {0};
    int rc = fs_export_estimate(project, photos, &e->export, &why);
    if (rc == FS_ERR_INPUT) return 0; // ingest, or export itself, will say it
    if (rc < 0 && err) *err = why;
    return rc;
}

// What training and the pictures after it take, the first by as many steps as fit into the minutes that are wanted,
// where they are, less `spent` seconds. An error where no steps that are worth it do.
static int find_steps(const FsProject *project, Estimate *e, double step, double spent, FsError *err)
{
    const Settings *set = &project->set;
    TrainPace pace;
    MUST(fs_train_time(project, &e->size, &pace, err));
    if (step > 0)
        e->render.seconds = e->size.photos * (pace.render + step * WRITE_STEPS * e->size.width * e->size.height);
    if (e->export.seconds > 0) e->export.seconds += e->size.photos * pace.render;
    double after = e->render.seconds + e->export.seconds, left = 60 * set->minutes - spent - after;
    e->steps = set->minutes > 0 ? fs_train_steps(set, &e->size, &pace, left) : set->steps;
    e->train.seconds = fs_train_seconds(set, &e->size, &pace, e->steps);
    if (set->minutes == 0 || e->train.seconds <= left) return 0;
    return fs_error_set(err, FS_ERR_INPUT,
                        "--minutes %g: with no more than %d steps, photos of %d x %d pixels take %.2f minutes; give so "
                        "many, or a smaller --long-edge",
                        set->minutes, e->steps, e->size.width, e->size.height,
                        0.01 + (spent + after + e->train.seconds) / 60);
}

// early: what a reference step took a while ago; other programs only make it longer.
static int find_seconds(const FsProject *project, Estimate *e, double begin, double early, FsError *err)
{
    double step, n = e->size.photos, threads = threads_of(project);
    MUST(fs_train_reference(project, &step, err));
    step = fmin(step, early);
    e->initialise.seconds = step * INITIALISE_STEPS * n * initialise_pixels(&e->size) / INITIALISE_PIXELS;
    if (!fs_initialise_looks(&project->set)) e->initialise.seconds *= INITIALISE_PLAIN;
    double pixels = fs_poses_pixels(project, &e->size);
    e->poses.seconds = step * n * POSES_STEPS * pixels;
    if (!*project->set.poses)
        e->poses.seconds += step * n * fmax(1, n / 100) * (threads * COLMAP_STEPS + COLMAP_MATCHES * pixels);
    if (e->done & FS_STAGE_INGEST) e->ingest.seconds = 0;
    if (e->done & FS_STAGE_POSES) e->poses.seconds = 0;
    if (e->done & FS_STAGE_INITIALISE) e->initialise.seconds = 0;
    double spent = e->ingest.seconds + e->poses.seconds + e->initialise.seconds;
    return find_steps(project, e, step, spent + fs_clock_seconds() - begin, err);
}

static const char *clock_text(double seconds, char text[24])
{
    int s = (int)(seconds + 0.5);
    if (s < 3600)
        snprintf(text, 24, "%d:%02d", s / 60, s % 60);
    else
        snprintf(text, 24, "%d:%02d h", s / 3600, s / 60 % 60);
    return text;
}

// Those up to the first that is to be done (again).
static unsigned stages_done(FsProject *project, const char *photos)
{
    static const unsigned order[] = {FS_STAGE_INGEST, FS_STAGE_POSES, FS_STAGE_INITIALISE, FS_STAGE_TRAIN};
    unsigned done = 0;
    if (!fs_file_exists(fs_file_at("%s/done/ingest.json", project->out).text)) return 0; // photos are read once
    if (!fs_ingest_look(project, photos)) return 0;
    int steps = project->set.steps;
    if (project->set.minutes > 0) fs_project_take_steps(project);
    for (int i = 0; i < 4 && fs_project_is_done(project, order[i]); i++) done |= order[i];
    project->set.steps = steps;
    return done;
}

int fs_estimate_run(FsProject *project, const char *photos, double begin, FsError *err)
{
    Estimate e = {0};
    FsError why = {0};
    bool resumes = project->set.resume && fs_file_exists(fs_file_at("%s/checkpoint/state.json", project->out).text);
    e.done = stages_done(project, photos);
    if (project->set.steps < LEAST_STEPS || resumes || (e.done & FS_STAGE_TRAIN)) return 0;
    double early = 0;
    MUST(fs_train_reference(project, &early, err));
    int rc = fs_ingest_estimate(project, photos, &e.size, &e.ingest, &why);
    if (rc == FS_ERR_INPUT) return 0; // ingest will say it
    if (rc < 0) {
        if (err) *err = why;
        return rc;
    }
    MUST(find_export(project, photos, &e, err));
    double seconds = 0, bytes = find_bytes(project, &e);
    MUST(fs_cost_check(&e.size, bytes, err));
    MUST(find_seconds(project, &e, begin, early, err));
    const RunCost *part[] = {&e.ingest, &e.poses, &e.initialise, &e.train, &e.render, &e.export};
    char text[7][24];
    for (int i = 0; i < 6; i++) {
        seconds += part[i]->seconds;
        clock_text(part[i]->seconds, text[i]);
    }
    fs_log_info(
        &project->log,
        "estimate: %d photos as %d x %d pixels: about %s (ingest %s, poses %s%s, initialise %s, train %s for %d "
        "steps, render %s%s%s) and %.1f GB of memory",
        e.size.photos, e.size.width, e.size.height, clock_text(seconds, text[6]), text[0], text[1],
        *project->set.poses ? "" : " roughly, by COLMAP", text[2], text[3], e.steps, text[4],
        e.export.seconds > 0 ? ", cleaned photos " : "", e.export.seconds > 0 ? text[5] : "", bytes / 1e9);
    return 0;
}

int fs_estimate_steps(FsProject *project, double begin, FsError *late, FsError *err)
{
    if (project->set.minutes == 0 || fs_project_take_steps(project)) return 0;
    Estimate e = {0};
    char text[24];
    double step = 0;
    bool alone = !(project->planned & FS_STAGE_RENDER);
    MUST(fs_train_size(project, &e.size, err));
    MUST(fs_cost_check(&e.size, fs_train_bytes(&project->set, &e.size), err)); // before trials of that size
    if (!alone) MUST(find_export(project, NULL, &e, err));
    if (!alone) MUST(fs_train_reference(project, &step, err));
    int rc = find_steps(project, &e, step, fs_clock_seconds() - begin, late);
    if (rc < 0 && (rc != FS_ERR_INPUT || alone || !e.steps)) {
        if (err) *err = *late;
        return rc;
    }
    project->set.steps = e.steps;
    fs_log_info(&project->log, "train: %d steps in about %s, by --minutes %g", e.steps,
                clock_text(e.train.seconds, text), project->set.minutes);
    return 0;
}

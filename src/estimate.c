#include "estimate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "ingest/ingest.h"
#include "train/train.h"

// What other stages take, in steps of training of a fixed size (fs_train_reference), measured beside them on the shared
// scenes and made captures, and bytes.
#define INITIALISE_STEPS 28.0  // a photo of INITIALISE_PIXELS
#define INITIALISE_PIXELS 6e4  // of the photos it works on
#define INITIALISE_BYTES 110.0 // a pixel of these
#define POSES_STEPS 170e-6     // a pixel of a picture: its features and points at known poses
#define POSES_BYTES 4.0        // a pixel of a picture, of all photos: features
#define COLMAP_BYTES 520.0     // a pixel of a picture, by each thread of COLMAP
#define COLMAP_STEPS 60.0      // a photo, on one thread: its pose by COLMAP, up to a hundred photos
#define WRITE_STEPS 50e-6      // a pixel of a view: its layers as files
#define PROGRAM_BYTES 3e7
enum { LEAST_STEPS = 200 }; // of a run that is worth a trial

typedef struct Estimate {
    RunSize size;
    RunCost ingest, poses, initialise, train, render;
} Estimate;

static int make(FsProject *project, const char *photos, Estimate *e, FsError *err)
{
    double step, render;
    MUST(fs_ingest_estimate(project, photos, &e->size, &e->ingest, err));
    MUST(fs_train_reference(project, &step, err));
    MUST(fs_train_estimate(project, &e->size, &e->train, &render, err));
    double n = e->size.photos, pixels = (double)e->size.width * e->size.height;
    double threads = project->set.threads > 0 ? project->set.threads : (double)sysconf(_SC_NPROCESSORS_ONLN);
    double small = fmin(pixels, INITIALISE_PIXELS);
    e->initialise = (RunCost){step * INITIALISE_STEPS * n * small / INITIALISE_PIXELS,
                              PROGRAM_BYTES + INITIALISE_BYTES * n * small};
    e->poses = (RunCost){step * n * POSES_STEPS * e->size.picture_pixels,
                         (POSES_BYTES * n + COLMAP_BYTES * threads) * e->size.picture_pixels};
    if (!*project->set.poses) e->poses.seconds += step * threads * COLMAP_STEPS * n * fmax(1, n / 100);
    e->render = (RunCost){n * (render + step * WRITE_STEPS * pixels), 0};
    return 0;
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

int fs_estimate_run(FsProject *project, const char *photos, FsError *err)
{
    Estimate e = {0};
    FsError why = {0};
    bool begun = fs_file_exists(fs_file_at("%s/done/ingest.json", project->out).text);
    if (project->set.steps < LEAST_STEPS || (begun && !project->set.force)) return 0;
    int rc = make(project, photos, &e, &why);
    if (rc == FS_ERR_INPUT) return 0; // ingest will say it
    if (rc < 0) {
        *err = why;
        return rc;
    }
    const RunCost *part[] = {&e.ingest, &e.poses, &e.initialise, &e.train, &e.render};
    double seconds = 0, bytes = 0, machine = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
    char text[6][24];
    for (int i = 0; i < 5; i++) {
        seconds += part[i]->seconds;
        bytes = fmax(bytes, part[i]->bytes);
        clock_text(part[i]->seconds, text[i]);
    }
    fs_log_info(
        &project->log,
        "estimate: %d photos as %d x %d pixels: about %s (ingest %s, poses %s%s, initialise %s, train %s, render "
        "%s) and %.1f GB of memory",
        e.size.photos, e.size.width, e.size.height, clock_text(seconds, text[5]), text[0], text[1],
        *project->set.poses ? "" : " roughly, by COLMAP", text[2], text[3], text[4], bytes / 1e9);
    if (bytes < 0.9 * machine) return 0;
    int long_edge = e.size.width > e.size.height ? e.size.width : e.size.height;
    return fs_error_set(err, FS_ERR_INPUT,
                        "%d photos at %d pixels need about %.1f GB of memory, this machine has %.1f: use a smaller "
                        "--long-edge (%d), or fewer photos",
                        e.size.photos, long_edge, bytes / 1e9, machine / 1e9,
                        (int)(long_edge * sqrt(0.8 * machine / bytes)) / 10 * 10);
}

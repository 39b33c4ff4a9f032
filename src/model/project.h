// What every stage gets: the folder, the settings, the callbacks. The names of what stages leave on disk:
//
//   ingest.json, linear/<view>.tif, linear/<view>_mask.png      by ingest (working images as shot)
//   originals.json                                               by ingest (where the photos are)
//   linear/fine/<view>.tif, <view>_mask.png                     by ingest (16-bit float, larger: to undo a lens on)
//   linear/features_masks/<view>.png.png                        by ingest, where masks were given (for COLMAP)
//   linear/features/<view>.png                                  by ingest (8 bits, x^0.35, larger: to find features)
//   views.json, images/<view>.tif, images/<view>_mask.png        by poses (undistorted, with cameras)
//   sparse/{cameras,images,points3D}.{txt,bin}                   by poses (COLMAP model of the joint frame)
//   start/<cloud>.ply or field.bin, start/model.json             by initialise
//   start/{transmitted,reflected}{,_surface}.ply                 by initialise
//   clouds/<cloud>.ply or field.bin, clouds/model.json           by train
//   clouds/photos.json, clouds/veil.tif                          by train
//   checkpoint/, progress/, log.jsonl                            by train
//   renders/<layer>/<view>.png, path/, video/, sheet.png         by render
//   renders/rendered_from.json, path/rendered_from.json          by render (of which clouds: rendered_from.h)
//   export/                                                      by export
//   evaluate.json                                                by evaluate
//   index.html, report/                                          by report
//   warnings/<stage>.txt                                         by each stage, as it runs
//   done/<stage>.json                                            by each stage, last: what its results follow from
//   .flashsplat/                                                 what in OUT is ours (owned.h), who writes, COLMAP's
//   work
//
// fs_project_stages says the same to the program.
//
// linear/ and images/ hold 32-bit float RGB TIFF, white-balanced camera RGB, linear, 1.0 = sensor white, negative
// noise kept; masks are 8-bit grey PNG, 255 where the pixel may be trusted, 0 where clipped or outside the photo.
#pragma once

#include <jansson.h>

#include "base/lock.h"
#include "base/log.h"
#include "model/settings.h"
#include "model/warnings.h"

struct FsProject {
    char *out;
    Settings set;
    Log log;
    size_t made_out;            // the length of out up to what was not there before; 0: it was
    Lock lock;                  // held from the first call that may write into out
    unsigned memory_failures;   // of the process, when the stage began
    Warnings *warnings;         // what log keeps for the report; NULL: nothing is kept
    char photos[17];            // hash of the photos, which ingest fills in; "": not there
    char *fingerprint;          // of the stage that is looked at: fs_project_done takes it before the stage reads
    unsigned fingerprint_stage; // which that is
    unsigned planned;           // FS_STAGE_*: all that are to run, where more than one
    bool worked;                // a stage began: not all was done already
};

// The stages of a project in their order, one row each.
enum { PROJECT_STAGES = 7, PROJECT_INPUTS = 5, PROJECT_OUTPUTS = 17 };
typedef struct ProjectStage {
    const char *name;
    unsigned stage, after;             // FS_STAGE_*; the stages whose results it reads, directly or not
    const char *input[PROJECT_INPUTS]; // files and folders in OUT that it reads
    // What it writes: % is each view, & each cloud, * whatever is there. With "=" it stays until it is overwritten,
    // else a stage that starts removes it; figures go with the training that they are of.
    const char *output[PROJECT_OUTPUTS];
} ProjectStage;
extern const ProjectStage fs_project_stages[PROJECT_STAGES];

// An error where another program works on the folder. Before anything in it is touched; once more does no harm.
int fs_project_lock(FsProject *project, FsError *err);

// Whether nothing can be written into the folder: a disk that is read-only, or a folder of others.
bool fs_project_is_read_only(const FsProject *project);

// True when <out>/done/<stage>.json exists, setting "force" is off, and the stage's settings and inputs are those it
// was made from; logs that the stage is skipped. A change makes it false and says which.
bool fs_project_done(FsProject *project, unsigned stage);
bool fs_project_is_done(FsProject *project, unsigned stage); // the same, without a word
// What the mark of a stage says, by the stage's name; the caller's. NULL: there is none that can be read.
json_t *fs_project_mark(const char *out, const char *stage);
// Whether a stage's mark says that it was done with this text of an option.
bool fs_project_done_with(const FsProject *project, unsigned stage, const char *option, const char *value);
int fs_project_mark_done(FsProject *project, unsigned stage, FsError *err); // last, when all of it is on the disk
void fs_project_unmark(const FsProject *project, unsigned stage);           // and the stages that read its results
bool fs_project_has_checkpoint(const char *out);                            // of a training
// Refuses where what the stage reads is of other photos, poses or settings than those that are there now.
int fs_project_check_earlier(const FsProject *project, unsigned stage, FsError *err);
// At the start of a stage's work, before it touches anything: checks that the stages whose results it reads were done
// since those that they follow from, that no checkpoint goes that setting "resume" wants, and that nothing of the
// user's is where this stage and those planned after it will write, then unmarks the stage and removes what it left
// (which stays where an export goes beside one of the same clouds). view: the names of the n views; NULL: those that
// were ingested.
int fs_project_begin(FsProject *project, unsigned stage, const char *const *view, int n, FsError *err);
// An error when a file or folder of the user's that a stage reads is not there, or is where results go.
int fs_project_check_input(const FsProject *project, const char *path, FsError *err);
// Renders that are to go to `path` must not get into what other stages made.
int fs_project_check_output(const FsProject *project, const char *path, FsError *err);

// An error: <out>/<name>, which the stage makes, is not there, and what makes it.
int fs_project_missing(const char *out, unsigned stage, const char *name, FsError *err);

// For what a stage leaves to go on from: settings and inputs as one text, taken when fs_project_done was asked. Store
// it beside the work; then see whether work of `was` belongs to it: an error that says what differs.
const char *fs_project_fingerprint(FsProject *project, unsigned stage); // NULL when out of memory
int fs_project_check(FsProject *project, unsigned stage, const char *was, const char *path, FsError *err);
// Sets the steps to those of a training of the same minutes, settings and inputs: one that is done, or a checkpoint
// that setting "resume" is to go on from. False where there is none.
bool fs_project_take_steps(FsProject *project);

// What every stage gets: the folder, the settings, the callbacks. The names of what stages leave on disk:
//
//   ingest.json, linear/<view>.tif, linear/<view>_mask.png      by ingest (working images as shot)
//   linear/features/<view>.png                                   by ingest (8 bits, x^0.35, larger: to find features)
//   views.json, images/<view>.tif, images/<view>_mask.png        by poses (undistorted, with cameras)
//   sparse/{cameras,images,points3D}.txt                         by poses (COLMAP text model of the joint frame)
//   start/<cloud>.ply, start/{transmitted,reflected}.ply         by initialise
//   clouds/<cloud>.ply, clouds/model.json                        by train
//   checkpoint/, progress/, log.jsonl                            by train
//   renders/<layer>/<view>.png, path/, video/, sheet.png         by render
//   export/                                                      by export
//   index.html, report/                                          by report
//   warnings/<stage>.txt                                         by each stage, as it runs
//   done/<stage>.json                                            by each stage, last: the settings it ran with
//
// linear/ and images/ hold 32-bit float RGB TIFF, white-balanced camera RGB, linear, 1.0 = sensor white, negative
// noise kept; masks are 8-bit grey PNG, 255 where the pixel may be trusted, 0 where clipped or outside the photo.
#ifndef FS_MODEL_PROJECT_H
#define FS_MODEL_PROJECT_H

#include "base/log.h"
#include "model/settings.h"
#include "model/warnings.h"

struct FsProject {
    char *out;
    Settings set;
    Log log;
    Warnings *warnings; // what log keeps for the report; NULL: nothing is kept
};

// True when <out>/done/<stage>.json exists, setting "force" is off, and the settings of that stage (stage_mask, one
// FS_STAGE_*) are the same as when it was written; logs that the stage is skipped. A changed setting makes it false
// and says which.
bool fs_project_done(const FsProject *project, const char *stage, unsigned stage_mask);
int fs_project_mark_done(const FsProject *project, const char *stage, unsigned stage_mask, FsError *err);
void fs_project_unmark(const FsProject *project,
                       const char *stage); // at the start of a stage's work, and of later ones

#endif

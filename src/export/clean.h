// The photos without the mirrored room, at their full size: OUT/export/photos/<view>.jpg, .tif, .dng.
#pragma once

#include "export/colors.h"
#include "model/originals.h"

enum { CLEAN_JPEG, CLEAN_TIFF, CLEAN_DNG, CLEAN_FORMATS };
void fs_clean_wanted(const char *list, bool wanted[CLEAN_FORMATS]); // of the setting "clean"

typedef struct CleanArgs {
    const FsProject *project;
    const Scene *scene;
    const Dataset *views;
    const Originals *originals;
    const Development *development; // of photos that are not encoded
    const bool *wanted;             // (CLEAN_FORMATS)
} CleanArgs;
// Whether all photos are those that were ingested: before cleaned ones of an earlier export go.
int fs_clean_check(const CleanArgs *args, FsError *err);
// One photo after the other: memory for one at its full size.
int fs_clean_run(const CleanArgs *args, FsError *err);

// How long a photo without the reflection takes: one of the capture's, with nothing mirrored in it, written and
// removed.
#pragma once

#include "export/clean.h"
#include "model/cost.h"

// Of all photos of a folder, but for the renders. FS_ERR_INPUT where other stages will say what is wrong.
int fs_clean_trial_run(const FsProject *project, const char *folder, const bool wanted[CLEAN_FORMATS], RunCost *cost,
                       FsError *err);

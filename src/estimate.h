// What a whole run will take in time and memory.
#pragma once

#include "model/project.h"

// Logs it, by small trials on this machine; an error where the machine has too little memory. Nothing where results are
// there already, or for a few steps.
int fs_estimate_run(FsProject *project, const char *photos, FsError *err);

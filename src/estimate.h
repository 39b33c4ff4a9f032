// What a whole run will take in time and memory, and how many steps of training fit into the setting minutes.
#pragma once

#include "model/project.h"

// Logs it, by small trials on this machine; an error where the machine has too little memory, or the wanted minutes are
// too few. Nothing where results are there already, or for a few steps.
int fs_estimate_run(FsProject *project, const char *photos, double begin, FsError *err);

// Right before training: sets the steps to as many as fit into what is left since `begin` of the setting minutes, the
// stages after it (FsProject.planned) counted; or to those of a training of the same minutes that is there already.
// late: why the minutes cannot be kept any more, where other stages of the same run took too long (a warning).
int fs_estimate_steps(FsProject *project, double begin, FsError *late, FsError *err);

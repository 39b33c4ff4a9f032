// The training stage: from OUT/start to OUT/clouds.
#ifndef FS_TRAIN_TRAIN_H
#define FS_TRAIN_TRAIN_H

#include "model/cost.h"
#include "model/project.h"

int fs_train_run(FsProject *project, FsError *err);

// What it will take (train_cost.c). render: seconds to render all layers of a view of that size at the end.
int fs_train_estimate(const FsProject *project, const RunSize *size, RunCost *cost, double *render, FsError *err);
double fs_train_bytes(const Settings *set, const RunSize *size);
int fs_train_reference(const FsProject *project, double *seconds,
                       FsError *err); // of a step of one size: the machine's speed

#endif

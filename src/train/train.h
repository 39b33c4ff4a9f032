// The training stage: from OUT/start to OUT/clouds.
#ifndef FS_TRAIN_TRAIN_H
#define FS_TRAIN_TRAIN_H

#include "model/cost.h"
#include "model/project.h"

int fs_train_run(FsProject *project, FsError *err);

// ---- what it will take (train_cost.c) ----

double fs_train_bytes(const Settings *set, const RunSize *size); // at most, of the program

typedef struct TrainPace {              // seconds on this machine, by trials
    int splats[2];                      // Gaussians per cloud: at the start, and when full
    double step[FS_SETTINGS_LEVELS][2]; // a step at each halving of the photos, with so many
    double render;                      // all layers of a view at the end
} TrainPace;
int fs_train_time(const FsProject *project, const RunSize *size, TrainPace *pace, FsError *err);
// Of so many steps, the looks before them and what is done between steps; not of the pictures at the end.
double fs_train_seconds(const Settings *set, const RunSize *size, const TrainPace *pace, int steps);
// The most steps that fit into so many seconds: at most those of the settings, and at least the fewest that are worth
// it, whether they fit or not.
int fs_train_steps(const Settings *set, const RunSize *size, const TrainPace *pace, double seconds);
// Of a step of one size with the usual settings by the scalar kernels: the speed of the machine for what is not
// training.
int fs_train_reference(const FsProject *project, double *seconds, FsError *err);
// Of the photos and the clouds that wait in the project folder.
int fs_train_size(FsProject *project, RunSize *size, FsError *err);

#endif

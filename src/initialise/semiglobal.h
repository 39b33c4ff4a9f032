// Semi-global matching: of a score per pixel and depth step, the step whose neighbours agree.
#ifndef FS_INITIALISE_SEMIGLOBAL_H
#define FS_INITIALISE_SEMIGLOBAL_H

#include "base/error.h"

typedef struct ScoreVolume {
    const float *score; // (height, width, steps), larger is better
    int width, height, steps;
} ScoreVolume;

// A neighbour one step away costs `small`, farther away `large`.
// best (height, width): the chosen step, between steps by a parabola.
int fs_semiglobal_choose(const ScoreVolume *volume, float small, float large, float *best, FsError *err);

#endif

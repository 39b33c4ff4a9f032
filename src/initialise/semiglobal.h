// Semi-global matching: of a score per pixel and depth step, the step whose neighbours agree.
#ifndef FS_INITIALISE_SEMIGLOBAL_H
#define FS_INITIALISE_SEMIGLOBAL_H

#include "base/error.h"

// score (height, width, steps), larger is better. A neighbour one step away costs `small`, farther away `large`.
// best (height, width): the chosen step, between steps by a parabola.
int fs_semiglobal_choose(const float *score, int width, int height, int steps, float small, float large, float *best,
                         FsError *err);

#endif

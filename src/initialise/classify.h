// Transmitted or mirrored: one decision per point, from the flash cue, the neighbours in space, the depths at which
// clear points of either kind lie, and that a ray meets one surface of each scene.
#ifndef FS_INITIALISE_CLASSIFY_H
#define FS_INITIALISE_CLASSIFY_H

#include "initialise/cue.h"

typedef enum PointKind { POINT_UNSURE = 0, POINT_TRANSMITTED = 1, POINT_REFLECTED = 2 } PointKind;

// kind (n); evidence (n): log of the odds for "transmitted", 0 where the cue says nothing.
int fs_classify_points(const Frames *frames, const float *xyz, const Cue *cue, int n, unsigned char *kind,
                       float *evidence, Threads *threads, FsError *err);

#endif

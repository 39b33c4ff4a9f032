// The flash cue of the published program: one depth parts the two scenes. Of what the flash lights, more points are
// found in the flash photos than in the others; up to the depth where that ends all is transmitted, beyond it mirrored.
// It fails where the scenes overlap in depth.
#ifndef FS_INITIALISE_DEPTH_CUE_H
#define FS_INITIALISE_DEPTH_CUE_H

#include "initialise/points.h"

// found: the points of the poses, with sightings. depth: where the scenes part, along the middle view.
int fs_depth_cue_find(const SmallViews *views, const SparsePoints *found, double *depth, FsError *err);
// Of two means (Lloyd) the value from which on one belongs to the higher; INFINITY where all are alike.
double fs_depth_cue_between_means(const double *value, int n);
// Sets kind; how many are mirrored.
int fs_depth_cue_part(const SmallViews *views, double depth, SparsePoints *points);

#endif

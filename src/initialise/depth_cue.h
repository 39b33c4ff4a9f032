// The flash cue of the published program: one depth parts the two scenes. Of what the flash lights, more points are
// found in the flash photos than in the others; up to the depth where that ends all is transmitted, beyond it mirrored.
// It fails where the scenes overlap in depth.
#ifndef FS_INITIALISE_DEPTH_CUE_H
#define FS_INITIALISE_DEPTH_CUE_H

#include "initialise/points.h"

// kind: (points->n), written; points->sightings must be known. depth: where the scenes part, along the middle view.
int fs_depth_cue_part(const SmallViews *views, const SparsePoints *points, unsigned char *kind, double *depth,
                      FsError *err);

#endif

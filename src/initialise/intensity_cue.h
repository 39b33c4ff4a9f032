// The flash cue as the paper words it: points whose light rose with the flash are transmitted, those where it did not
// are reflected. It is a weak one, since a mirrored point's light holds that of what lies behind the pane there, which
// rose too. From how much on it rose, two means tell.
#ifndef FS_INITIALISE_INTENSITY_CUE_H
#define FS_INITIALISE_INTENSITY_CUE_H

#include "initialise/points.h"

// Sets kind. growth: of the light from which on points are transmitted; mirrored: how many are not. Points that photos
// of one lighting alone show are taken for transmitted.
int fs_intensity_cue_part(const SmallViews *views, SparsePoints *points, double *growth, int *mirrored, FsError *err);

#endif

// Transmitted or mirrored: one decision per point, from the flash cue, the neighbours in space, the depths at which
// clear points of either kind lie, and that a ray meets one surface of each scene.
#ifndef FS_INITIALISE_CLASSIFY_H
#define FS_INITIALISE_CLASSIFY_H

#include "initialise/constants.h"
#include "initialise/cue.h"

// Log of the odds for "transmitted" that a depth alone tells, over the logarithm of the depth in the middle view.
typedef struct DepthOdds {
    float min, step; // log depth of odds[0], and between two
    float rare;      // what odds hold whatever the depth: 0, or how much rarer mirrored points were held for
    float odds[DEPTH_ODDS_STEPS];
} DepthOdds;
float fs_classify_depth_odds(const DepthOdds *odds, float log_depth);
// The same for the growth of contrast alone: its logarithm, that logarithm's uncertainty.
float fs_classify_slope_odds(float log_slope, float sigma);

// Fills in the kind of points with cues; what the depths tell into *depth_odds.
int fs_classify_points(const SmallViews *views, SparsePoints *points, DepthOdds *depth_odds, Threads *threads,
                       FsError *err);

#endif

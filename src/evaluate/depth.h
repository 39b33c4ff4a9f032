// Depth of a scene against the truth's.
#pragma once

#include "base/log.h"
#include "evaluate/truth.h"

typedef struct DepthViewScore {
    char name[256];
    bool missing;
    double error, covered; // as below, of this view
} DepthViewScore;

typedef struct DepthScore {
    const char *layer; // as "depth_T"; NULL where the truth has none
    int n, missing;
    double error;         // median over all pixels of |depth - truth| / truth
    double scale;         // median of truth / depth: what the scene's unit lacks to a metre
    double error_scaled;  // the same error after that scale
    double covered;       // share of the truth's pixels that have a depth
    DepthViewScore *view; // (n + missing)
} DepthScore;

// Truth: 16-bit PNG in millimetres, 0 = none. Estimate: <dir>/<layer>/<view>.png in the same form, or a float TIFF in
// world units, taken for metres; what else is there is an error, of others (not `ours`) left out. The smaller image's
// pixel centres are compared with the nearest pixel of the larger.
int fs_depth_score(DepthScore *score, const char *layer, const TruthViews *views, const char *dir, const Log *log,
                   bool ours, FsError *err);
void fs_depth_free(DepthScore *score);

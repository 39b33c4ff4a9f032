// Depth maps of both scenes: plane sweeps from views spread over the capture, two depths per ray, and of those the
// points on which views agree.
#ifndef FS_INITIALISE_STEREO_H
#define FS_INITIALISE_STEREO_H

#include "initialise/constants.h"
#include "initialise/plane_sweep.h"
#include "initialise/start.h"

// Both scenes' inverse depths in the swept views, (height, width); 0 where unsure.
typedef struct DepthMap {
    Camera camera;
    float *layer[2]; // transmitted, reflected; NULL: this view was not swept
    float *guess;    // of the transmitted scene also where unsure
    bool *dull;      // where cue and depth call that surface rather mirrored
} DepthMap;

typedef struct DepthMaps {
    int n, view[STEREO_VIEWS]; // swept
    DepthRange range[STEREO_VIEWS];
    DepthMap map[STEREO_VIEWS];
} DepthMaps;

void fs_stereo_free(DepthMaps *maps);
// From the classified points and what their depths tell. May come out empty.
int fs_stereo_find(const Start *start, DepthMaps *maps, FsError *err);
// Finds one scene's surfaces once more, in photos that the other one was subtracted from. lit_odds: the share that
// counts of what depths tell for "transmitted".
int fs_stereo_renew(const Start *start, const SmallViews *residual, SweepAim aim, float lit_odds, DepthMaps *maps,
                    FsError *err);
// Takes dull surfaces out of the transmitted ones.
void fs_stereo_forget_dull(DepthMaps *maps);
// Depth fusion: the points on which views agree, with at least so many votes: two of each other view that agrees.
int fs_stereo_fuse(const DepthMaps *maps, bool reflected, int votes, PointList *points, FsError *err);

#endif

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
} DepthMap;

typedef struct DepthMaps {
    int n, view[STEREO_VIEWS]; // swept
    DepthRange range[STEREO_VIEWS];
    DepthMap map[STEREO_VIEWS];
} DepthMaps;

void fs_stereo_free(DepthMaps *maps);
// From the classified points and what their depths tell. May come out empty.
int fs_stereo_find(const Start *start, DepthMaps *maps, FsError *err);
// Finds one scene's surfaces once more, in photos that the other scene was subtracted from.
int fs_stereo_renew(const Start *start, const SmallViews *residual, bool reflected, DepthMaps *maps, FsError *err);
// Depth fusion: the points on which views agree.
int fs_stereo_fuse(const DepthMaps *maps, bool reflected, PointList *points, FsError *err);

#endif

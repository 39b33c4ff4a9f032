// Dense surfaces of both scenes: plane sweeps from views spread over the capture, two depths per ray, and of those the
// points on which views agree.
#ifndef FS_INITIALISE_STEREO_H
#define FS_INITIALISE_STEREO_H

#include "base/log.h"
#include "initialise/classify.h"

typedef struct DensePoints {
    int n, capacity;
    float *xyz; // (n, 3)
} DensePoints;

void fs_stereo_points_free(DensePoints *points);

enum { STEREO_VIEWS = 8 }; // swept at most

// Both scenes' inverse depths in the swept views, (height, width); 0 where unsure.
typedef struct DepthMap {
    Camera camera;
    float *layer[2]; // transmitted, reflected; NULL: this view was not swept
    float *guess;    // of the transmitted scene also where unsure
} DepthMap;

typedef struct DepthMaps {
    int n, view[STEREO_VIEWS], steps[STEREO_VIEWS]; // frames swept, and steps of depth in each
    float inverse_min[STEREO_VIEWS], inverse_max[STEREO_VIEWS];
    DepthMap map[STEREO_VIEWS];
} DepthMaps;

void fs_stereo_free(DepthMaps *surfaces);
// From the classified points (n) and what their depths tell. May come out empty.
int fs_stereo_find(const Frames *frames, const float *xyz, const unsigned char *kind, int n, const DepthOdds *odds,
                   const Log *log, Threads *threads, DepthMaps *surfaces, FsError *err);
// Finds one scene's surfaces once more, in photos that the other scene was taken off.
int fs_stereo_renew(const Frames *freed, bool reflected, const DepthOdds *odds, const Log *log, Threads *threads,
                    DepthMaps *surfaces, FsError *err);
// The points on which views agree.
int fs_stereo_fuse(const DepthMaps *surfaces, bool reflected, DensePoints *points, FsError *err);

#endif

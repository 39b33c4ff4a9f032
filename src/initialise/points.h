// Points of the scenes: a growing list of places; and the sparse points of poses with what the stage learns of each.
#ifndef FS_INITIALISE_POINTS_H
#define FS_INITIALISE_POINTS_H

#include "base/error.h"
#include "base/threads.h"
#include "initialise/small_views.h"

typedef struct PointList {
    int n;
    float *xyz; // (n, 3) world
    int alone;  // the last so many: no surface is carried on from them
} PointList;

int fs_points_append(PointList *list, const float xyz[3], FsError *err); // world
void fs_points_list_free(PointList *list);

typedef enum PointKind { POINT_UNSURE = 0, POINT_TRANSMITTED = 1, POINT_REFLECTED = 2 } PointKind;

typedef struct Cue { // cue.h
    bool ok;         // seen well enough for the rest to mean something
    float log_slope; // log of the contrast's growth
    float sigma;     // its standard deviation, by leaving out one photo at a time
    float coherence; // 0..1: share of the patches' contrast that belongs to this depth
    float slope[3];  // growth per colour channel; 0 where unknown
} Cue;

typedef struct SparsePoints {
    int n;
    float *xyz;          // (n, 3)
    Cue *cue;            // (n)
    unsigned char *kind; // (n) PointKind
    int (*sightings)[2]; // (n) photos that found it, without the flash and with it; where depth_cue.h asks for them
} SparsePoints;

int fs_points_new(SparsePoints *points, int n, FsError *err); // n, all of them 0
void fs_points_free(SparsePoints *points);

#endif

// Points from features at known poses: matches along epipolar lines, then points that several photos agree on.
#pragma once

#include "base/error.h"
#include "base/log.h"
#include "base/threads.h"
#include "model/camera.h"
#include "poses/features.h"

typedef struct Seen { // one observation of a point
    int photo, feature;
} Seen;

typedef struct Point {
    double xyz[3];
    double error; // mean reprojection error in pixels
    int first, n; // its observations: PointSet.seen[first .. first + n)
} Point;

typedef struct PointSet {
    Point *point;
    Seen *seen;
    int n, n_seen;
} PointSet;

typedef struct TriangulateOptions {
    float tolerance_px;   // how far from where it should be an observation may lie
    float max_ratio;      // best descriptor distance against the second best along the line
    float max_distance;   // largest descriptor distance
    double false_alarms;  // expected number of chance agreements under which a point is believed
    double min_angle_deg; // between the rays of some two of its observations
} TriangulateOptions;
extern const TriangulateOptions fs_triangulate_defaults;

typedef struct PosedFeatures {
    const Features *features; // (n) xy already without lens distortion
    const Camera *camera;     // (n) pinhole, in the pixels of the features
    int n;
} PosedFeatures;

// Same result for any number of threads.
int fs_triangulate(const PosedFeatures *photos, const TriangulateOptions *options, Threads *threads, const Log *log,
                   PointSet *points, FsError *err);
void fs_triangulate_free(PointSet *points);

// Depth fusion: a grid of boxes (voxels), each with its mean distance to the surface that views see, cut off at
// `reach` before and behind it (a truncated signed distance function; positive before the surface).
#pragma once

#include "base/threads.h"
#include "image/image.h"
#include "model/camera.h"

typedef struct Tsdf {
    int size[3];      // voxels along x y z
    double origin[3]; // middle of voxel 0 0 0, world
    double step;      // from one to the next
    double reach;
    float *distance; // (size[2], size[1], size[0]) in units of reach, -1..1
    float *weight;   // how many views said so
} Tsdf;

// box: least and greatest corner. At most `most` voxels: step grows until they suffice.
int fs_tsdf_new(Tsdf *tsdf, const double box[2][3], double step, double most, FsError *err);
void fs_tsdf_free(Tsdf *tsdf);
// Adds what a view sees. depth: z of each pixel, 0 where it is not known.
void fs_tsdf_fuse(Tsdf *tsdf, const Camera *camera, const Image *depth, Threads *threads);

static inline size_t fs_tsdf_at(const Tsdf *tsdf, int x, int y, int z)
{
    return ((size_t)z * (size_t)tsdf->size[1] + (size_t)y) * (size_t)tsdf->size[0] + (size_t)x;
}

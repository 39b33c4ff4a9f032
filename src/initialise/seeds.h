// Where the Gaussians of one scene start: on the points known to belong to it, on surfaces carried on between those so
// that every pixel of every photo is covered, and on copies of the points, up to an exact count.
#ifndef FS_INITIALISE_SEEDS_H
#define FS_INITIALISE_SEEDS_H

#include "base/threads.h"
#include "initialise/small_views.h"

typedef struct Seeds {
    int n;
    float *xyz;   // (n, 3) world
    float *scale; // (n) radius, world: distance to the nearest others
} Seeds;

// points (n_points, 3) of the scene, at least one in front of a camera.
int fs_seeds_make(const Frames *frames, const float *points, int n_points, int count, uint64_t seed, Threads *threads,
                  Seeds *seeds, FsError *err);
void fs_seeds_free(Seeds *seeds);

// Frames in the order of how much they add: the one in the middle, then always the one farthest from those before.
void fs_seeds_order(const Frames *frames, int *order);

// Inverse depth (height, width) of a frame at a fraction of its size, from points; *any: false when none is in view.
// Where several points share a pixel the nearest count.
int fs_seeds_depth(const Frame *frame, const float *points, int n_points, int width, int height, float *inverse_depth,
                   bool *any, FsError *err);

#endif

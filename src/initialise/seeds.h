// Where the Gaussians of one scene start: on the points known to belong to it, on surfaces carried on between those so
// that every pixel of every photo is covered, and on copies of the points, up to an exact count.
#ifndef FS_INITIALISE_SEEDS_H
#define FS_INITIALISE_SEEDS_H

#include "initialise/points.h"

typedef struct Seeds {
    int n;
    float *xyz;   // (n, 3) world
    float *scale; // (n) radius, world: distance to the nearest others
    int n_points; // the first so many are points themselves
} Seeds;

// points of the scene, at least one in front of a camera.
int fs_seeds_make(const SmallViews *views, const PointList *points, int count, uint64_t seed, Threads *threads,
                  Seeds *seeds, FsError *err);
void fs_seeds_free(Seeds *seeds);

// SmallViews in the order of how much they add: the one in the middle, then always the one farthest from those before.
int fs_seeds_order(const SmallViews *views, int *order, FsError *err); // order: (views->n)

#endif

// The flash's light on the transmitted scene, as measured from the contrast growth of the transmitted points:
//   alpha_c = color[c] * exp(gain) * (distance / distance to the flash)^2      (model/scene.h)
#ifndef FS_INITIALISE_LIGHT_H
#define FS_INITIALISE_LIGHT_H

#include "initialise/points.h"
#include "initialise/seeds.h"

typedef struct FlashLight {
    double color[3];
    double distance; // median distance of the transmitted points from the flash
} FlashLight;

// From classified points. Falls back to alpha = 1 when too few transmitted points have a clear cue.
int fs_light_fit(const SmallViews *views, const SparsePoints *points, FlashLight *light, FsError *err);
// gain (seeds->n): carried over from the points by nearest neighbours.
int fs_light_gains(const SmallViews *views, const FlashLight *light, const SparsePoints *points, const Seeds *seeds,
                   float *gain, Threads *threads, FsError *err);
// (distance / distance to the flash)^2, averaged over the flash photos.
double fs_light_falloff(const SmallViews *views, const FlashLight *light, const float xyz[3]);

#endif

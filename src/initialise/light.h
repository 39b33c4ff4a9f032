// The flash's light on the transmitted scene, as measured from the contrast growth of the transmitted points:
//   alpha_c = color[c] * exp(gain) * (distance / distance to the flash)^2      (model/scene.h)
#ifndef FS_INITIALISE_LIGHT_H
#define FS_INITIALISE_LIGHT_H

#include "initialise/classify.h"

#define FS_LIGHT_GAIN_MAX 1.5f // the logarithm of the gain stays within this

typedef struct FlashLight {
    double color[3];
    double distance;   // median distance of the transmitted points from the flash
    double mean_slope; // median of 1 + alpha over the transmitted points
} FlashLight;

// n points with their cues and kinds. Falls back to alpha = 1 when too few transmitted points have a clear cue.
int fs_light_fit(const Frames *frames, const float *xyz, const Cue *cue, const unsigned char *kind, int n,
                 FlashLight *light, FsError *err);
// gain (n_at): carried over from the points to other places by their nearest neighbours.
int fs_light_gains(const Frames *frames, const FlashLight *light, const float *xyz, const Cue *cue,
                   const unsigned char *kind, int n, const float *at, int n_at, float *gain, Threads *threads,
                   FsError *err);
// (distance / distance to the flash)^2, averaged over the flash photos.
double fs_light_falloff(const Frames *frames, const FlashLight *light, const float xyz[3]);

#endif

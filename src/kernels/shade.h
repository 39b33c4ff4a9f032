// Colour of a transmitted Gaussian under the flash, where one geometry holds both lightings:
//
//   T_F = (1 + alpha) T_N in linear light (Flash-Splat, section 3), so in tone-mapped colour
//   feature_c = color_c (1 + alpha_c)^0.22,   alpha_c = tint_c exp(gain) (flash_distance / |mean - flash|)^2
//
// The flash sits at the camera, so its light falls off with the distance that each photo knows.
#ifndef FS_KERNELS_SHADE_H
#define FS_KERNELS_SHADE_H

#include <stdbool.h>

#include "base/optics.h"

typedef struct ShadeLight {
    float centre[3];      // of the camera, world
    float flash_distance; // world units
    float tint[3];
    bool even; // the flash's light does not fall off with distance
} ShadeLight;

typedef struct ShadeCloud {
    const float *means; // (N, 3)
    float *colors;      // (N, 3) tone-mapped; only enter and leave change them
    const float *gains; // (N, 1) or NULL: all 0
} ShadeCloud;

typedef struct ShadeGradients {
    float *colors; // (N, 3)
    float *gains;  // (N, 1); NULL with gains
} ShadeGradients;

typedef struct ShadeKernels {
    // out (N, 3), for i in [begin, end)
    void (*forward)(const ShadeLight *light, const ShadeCloud *cloud, int begin, int end, float *out);
    // d_out (N, 3) -> d, written; d_tint[3]: part of the sum over [begin, end). The falloff's gradient on means is left
    // out: where a surface is, is for its picture to say.
    void (*backward)(const ShadeLight *light, const ShadeCloud *cloud, int begin, int end, const float *d_out,
                     const ShadeGradients *d, double d_tint[3]);
    // The optimiser's view of a Gaussian: its colour under the flash and its gain. In deep shade T_N is a small part of
    // what the photos show while T_F is a large one, so (T_N, gain) is a bad pair to step: the flash photos' gradients
    // drown what the others say about T_N. With T_F known, the gain alone is T_N, and only no-flash photos move it.
    //
    // enter: colors T_N -> T_F, d from gradients of (T_N, gain) to those of (T_F, gain), in place; leave: colors
    // T_F -> T_N, by the gains as they are now. Rows whose `visible` is 0 stay.
    void (*enter)(const ShadeLight *light, const ShadeCloud *cloud, const unsigned char *visible, int begin, int end,
                  const ShadeGradients *d);
    void (*leave)(const ShadeLight *light, const ShadeCloud *cloud, const unsigned char *visible, int begin, int end);
} ShadeKernels;

extern const ShadeKernels fs_shade_scalar, fs_shade_avx2, fs_shade_avx512, fs_shade_neon;

#endif

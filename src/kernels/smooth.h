// Edge-preserving smoothness of a map (Flash-Splat's depth and beta terms):
//
//   L = 1/4 sum over k of mean over the pairs (p, p + o_k) of f(|u(p) - u(p + o_k)|),   f(t) = t exp(-t / g),
//
// for the four neighbours o = right, down, and the two diagonals below. Each mean is over the pairs inside the map.
// A strip gathers: it writes the gradient of its own rows and reads one row above and one below.
#ifndef FS_KERNELS_SMOOTH_H
#define FS_KERNELS_SMOOTH_H

#include "kernels/planes.h"

typedef struct SmoothArgs {
    const Planes *map; // (1, h, w)
    float g;           // > 0
    float weight;
    const Planes *d_map; // (1, h, w) weight * dL/du is added; NULL: value only
    const Planes *guide; // (3, h, w) of guided
} SmoothArgs;

typedef struct SmoothKernels {
    double (*loss)(const SmoothArgs *args, int y0, int y1); // this strip's part of L (not weighted)
    // The same with f(t) = t exp(-d / g), d the sum of what the guide's channels differ by (NeRFReN, Guo et al. 2022,
    // eq. 6).
    double (*guided)(const SmoothArgs *args, int y0, int y1);
} SmoothKernels;

extern const SmoothKernels fs_smooth_scalar, fs_smooth_avx2, fs_smooth_avx512, fs_smooth_neon;

// 1/4 of one over the number of pairs, for right, down and (twice) diagonal; 0 where there is none.
typedef struct SmoothScales {
    float right, down, diagonal;
} SmoothScales;
static inline SmoothScales fs_smooth_scales(int width, int height)
{
    double w = width, h = height;
    SmoothScales s = {0, 0, 0};
    if (w > 1) s.right = (float)(0.25 / ((w - 1) * h));
    if (h > 1) s.down = (float)(0.25 / (w * (h - 1)));
    if (w > 1 && h > 1) s.diagonal = (float)(0.25 / ((w - 1) * (h - 1)));
    return s;
}

#endif

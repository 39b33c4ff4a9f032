// Who stands in the mirrored light's way, photo by photo: a coarse grid of the share q of it that does not arrive,
// interpolated linearly between the middles of its cells, held beyond the outer ones,
//
//   beta' = (1 - q) beta.
//
// What no photo sees of the mirrored scene nothing tells: there it shall be what is around it. around: what a render R
// has where nobody stands, in cells, and from there carried on to the others (image/fill.h).
#ifndef FS_KERNELS_OCCLUSION_H
#define FS_KERNELS_OCCLUSION_H

#include "kernels/planes.h"

enum { OCCLUSION_WIDTH = 64, OCCLUSION_HEIGHT = 48, OCCLUSION_CELLS = OCCLUSION_WIDTH * OCCLUSION_HEIGHT };

#define OCCLUSION_OPEN 0.1f  // q below which nobody stands there,
#define OCCLUSION_HIDES 0.5f // and above which somebody does

// Of a cell's pixels: sums over those that count, their number, and how many there are.
typedef struct OcclusionSums {
    float rgb[3 * OCCLUSION_CELLS], n[OCCLUSION_CELLS], all[OCCLUSION_CELLS];
} OcclusionSums;

typedef struct OcclusionAroundArgs {
    const float *q;
    const Planes *R, *d_R; // 3 planes, tone-mapped
    const float *around;   // (cells, 3)
    float weight;
} OcclusionAroundArgs;

typedef struct OcclusionKernels {
    // q: (OCCLUSION_HEIGHT, OCCLUSION_WIDTH), 0..1. beta and hidden, what is left of it: 1 plane each, rows [y0, y1);
    // in place is allowed.
    void (*forward)(const float *q, const Planes *beta, const Planes *hidden, int y0, int y1);
    // From dL/dhidden: dL/dbeta (written, in place is allowed); the part of the rows is added to dL/dq.
    void (*backward)(const float *q, const Planes *beta, const Planes *d_hidden, const Planes *d_beta, int y0, int y1,
                     float *d_q);
    // R where nobody stands. The part of the rows is added to `sums`.
    void (*open)(const float *q, const Planes *R, OcclusionSums *sums, int y0, int y1);
    // L = mean over all pixels and channels of |R - around| where somebody stands. This strip's part of L (not
    // weighted); weight * dL/dR, with `around` as given, is added to d_R.
    double (*apart)(const OcclusionAroundArgs *args, int y0, int y1);
    // What a photo has beyond a render of it, both of 3 planes, by the weights of its pixels (1 plane). The part of the
    // rows is added to `sums`.
    void (*differ)(const Planes *photo, const Planes *render, const Planes *weight, OcclusionSums *sums, int y0,
                   int y1);
} OcclusionKernels;

extern const OcclusionKernels fs_occlusion_scalar, fs_occlusion_avx2, fs_occlusion_avx512, fs_occlusion_neon;

#endif

// Who stands in the mirrored light's way, photo by photo: a coarse grid of the share q of it that does not arrive,
// interpolated linearly between the middles of its cells, held beyond the outer ones,
//
//   beta' = (1 - q) beta.
#ifndef FS_KERNELS_OCCLUSION_H
#define FS_KERNELS_OCCLUSION_H

#include "kernels/planes.h"

enum { OCCLUSION_WIDTH = 64, OCCLUSION_HEIGHT = 48, OCCLUSION_CELLS = OCCLUSION_WIDTH * OCCLUSION_HEIGHT };

typedef struct OcclusionKernels {
    // q: (OCCLUSION_HEIGHT, OCCLUSION_WIDTH), 0..1. beta and hidden, what is left of it: 1 plane each, rows [y0, y1);
    // in place is allowed.
    void (*forward)(const float *q, const Planes *beta, const Planes *hidden, int y0, int y1);
    // From dL/dhidden: dL/dbeta (written, in place is allowed); the part of the rows is added to dL/dq.
    void (*backward)(const float *q, const Planes *beta, const Planes *d_hidden, const Planes *d_beta, int y0, int y1,
                     float *d_q);
} OcclusionKernels;

extern const OcclusionKernels fs_occlusion_scalar, fs_occlusion_avx2, fs_occlusion_avx512, fs_occlusion_neon;

#endif

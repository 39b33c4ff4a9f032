// EWA projection of Gaussians to splats (Zwicker et al. 2001; 3DGS, section 4), forward and backward.
//
//   p = R mean + t,  J = [[fx/z, 0, -fx x/z^2], [0, fy/z, -fy y/z^2]],  V = J R Rq diag(exp(scales))
//   cov = V V^T + diag(dilation) (pixels; 0.3 where a pixel of the photo is one of the camera),  conic = cov^-1,  log2
//   alpha = L - log2(e)/2 d^T conic d,  L = log2 sigmoid(opacity)
#ifndef FS_KERNELS_PROJECTION_H
#define FS_KERNELS_PROJECTION_H

#include "kernels/raster.h"

#define FS_COV_DILATION 0.3f

typedef struct ProjectCamera {
    float rotation[9], translation[3]; // world to camera
    float fx, fy, cx, cy;
    float near;                   // splats with z under this are invisible, world units
    int width, height;            // pixels
    float limit_x, limit_y;       // |x/z| and |y/z| are clamped to this in J
    float dilation_x, dilation_y; // pixels squared
} ProjectCamera;

// Parameters and, for backward, their gradients: (N, 3), (N, 3), (N, 4), (N, 1).
typedef struct ProjectParams {
    float *means, *scales, *quats, *opacities;
} ProjectParams;

typedef struct ProjectBack { // what backward starts from
    const Splat *splats;     // of forward
    const float *moments;    // (N, FS_RECORD) the reduced gradient records, of which the first six are read
    const float *d_depth;    // (N) gradient of z
} ProjectBack;

typedef struct ProjectKernels {
    // Writes splats[i] for i in [begin, end), all but `feature`.
    void (*forward)(const ProjectCamera *camera, const ProjectParams *params, int begin, int end, float t_min,
                    Splat *splats);
    // Writes gradients for i in [begin, end); those of invisible splats become 0.
    void (*backward)(const ProjectCamera *camera, const ProjectParams *params, int begin, int end,
                     const ProjectBack *from, const ProjectParams *gradients);
} ProjectKernels;

extern const ProjectKernels fs_project_scalar, fs_project_avx2, fs_project_avx512, fs_project_neon;

#endif

// The photo term of the loss, value and gradient in one pass over the image:
//
//   L = (1 - lambda - kappa) mean(m |I - Y|) + lambda mean(m (1 - SSIM(I, Y))) + kappa mean(m V(I, Y))
//
// with means over all pixels and channels.
// SSIM: 11 x 11 Gaussian window, sigma 1.5, zeros beyond the border, C1 = 0.01^2, C2 = 0.03^2, per channel.
// V = var(I - Y) / (2 var(Y) + C3), C3 = 1e-4, in the same windows: what SSIM's contrast and structure come to where
// the two have the same variance. SSIM of a noisy photo is best where I has more contrast than the light had; V is best
// where I is the light.
// m is a weight 0..1 per pixel (0: clipped, unknown). Where m < 1 the window sees m I + (1 - m) Y, so that a masked
// pixel of I neither costs anything nor disturbs its neighbours.
//
// The gradient of row y needs SSIM's derivative in rows y - 5 .. y + 5, which a strip computes for itself: strips of
// 32 rows or more keep that overlap small.
#ifndef FS_KERNELS_PHOTOMETRIC_H
#define FS_KERNELS_PHOTOMETRIC_H

#include "kernels/planes.h"

typedef struct PhotometricArgs {
    const Planes *I, *Y;        // (3, h, w) rendered, photo; tone-mapped
    const Planes *mu_Y, *var_Y; // (3, h, w) of the photo's windows, made by target_stats
    const Planes *mask;         // (1, h, w) 0..1; NULL: 1
    float lambda, kappa, weight;
    const Planes *d_I; // (3, h, w) set to weight * dL/dI; NULL: value only
    void *scratch;     // fs_photometric_scratch(width) bytes, 64-byte aligned, one per thread
} PhotometricArgs;

typedef struct PhotometricSums {
    double l1, dssim, contrast; // this strip's part of the three means (not weighted); 0 of what has no share
} PhotometricSums;

typedef struct PhotometricKernels {
    // Once per photo: fills mu_Y and var_Y from Y.
    void (*target_stats)(const PhotometricArgs *args, int y0, int y1);
    PhotometricSums (*loss)(const PhotometricArgs *args, int y0, int y1);
} PhotometricKernels;

extern const PhotometricKernels fs_photometric_scalar, fs_photometric_avx2, fs_photometric_avx512, fs_photometric_neon;

enum {
    FS_PHOTOMETRIC_RADIUS = 5,
    FS_PHOTOMETRIC_PAD = 16,                           // floats before a scratch row's first column
    FS_PHOTOMETRIC_RING = 16,                          // rows kept of a map, at least 11
    FS_PHOTOMETRIC_ROWS = 5 + 4 * FS_PHOTOMETRIC_RING, // scratch rows
};

static inline size_t fs_photometric_pitch(int width) // floats of a scratch row
{
    return (size_t)fs_planes_stride(width) + 2 * FS_PHOTOMETRIC_PAD;
}
static inline size_t fs_photometric_scratch(int width)
{
    return sizeof(float) * FS_PHOTOMETRIC_ROWS * fs_photometric_pitch(width);
}

#endif

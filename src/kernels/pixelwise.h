// What a training step does to single pixels beside the image equation.
#ifndef FS_KERNELS_PIXELWISE_H
#define FS_KERNELS_PIXELWISE_H

#include "kernels/planes.h"

// L = mean of |a - b|; weight * dL is added to d_a and d_b. 1 plane each.
typedef struct ApartArgs {
    const Planes *a, *b, *d_a, *d_b;
    float weight;
} ApartArgs;

typedef struct PixelwiseKernels {
    // beta of a beta cloud: out = 1 / (1 + e^-logit); 1 plane each, for rows [y0, y1).
    void (*sigmoid)(const Planes *logit, const Planes *out, int y0, int y1);
    void (*sigmoid_backward)(const Planes *out, const Planes *d_out, const Planes *d_logit, int y0, int y1); // written
    // What is mirrored where covers hide it: hidden = (1 - c) beta, c = min(m / 0.9, 1), for what covers nearly all
    // covers all. m: the covers as rendered. 1 plane each.
    void (*cover)(const Planes *m, const Planes *beta, const Planes *hidden, int y0, int y1);
    // d_beta: from dL/dhidden to dL/dbeta, in place; d_m: written.
    void (*cover_backward)(const Planes *m, const Planes *beta, const Planes *d_beta, const Planes *d_m, int y0,
                           int y1);
    // The weight 0..1 of each pixel in this step: a clipped pixel (mask 0) was at least as bright as its photo says, so
    // it has a say (1) while the render I is darker than that. mask, out: 1 plane; photo, I: 3, tone-mapped. Pixels
    // outside an undistorted photo are 0 there, so they never have.
    void (*clipped)(const Planes *mask, const Planes *photo, const Planes *I, const Planes *out, int y0, int y1);
    // L = mean of the light that passes all splats: a dark surface that lets light of what lies behind it through would
    // explain the photos as well, from where they were taken. This strip's part of L (not weighted); weight * dL goes
    // to d_passes (written).
    double (*opaque)(const Planes *passes, float weight, const Planes *d_passes, int y0, int y1);
    double (*apart)(const ApartArgs *args, int y0, int y1); // this strip's part of L
} PixelwiseKernels;

extern const PixelwiseKernels fs_pixelwise_scalar, fs_pixelwise_avx2, fs_pixelwise_avx512, fs_pixelwise_neon;

#endif

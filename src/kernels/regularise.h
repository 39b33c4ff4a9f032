// Gradients of what training asks of parameters alone (3DGS-MCMC, Kheradmand et al. 2024, eq. 8), added to others.
#ifndef FS_KERNELS_REGULARISE_H
#define FS_KERNELS_REGULARISE_H

#include <stddef.h>

typedef struct RegulariseKernels {
    // Of weight * sum sigmoid(x): d += weight s (1 - s).
    void (*sigmoid)(const float *x, size_t n, float weight, float *d);
    // Of weight * sum e^x: d += weight e^x.
    void (*exp)(const float *x, size_t n, float weight, float *d);
} RegulariseKernels;

extern const RegulariseKernels fs_regularise_scalar, fs_regularise_avx2, fs_regularise_avx512, fs_regularise_neon;

#endif

// What training asks of parameters alone (3DGS-MCMC, Kheradmand et al. 2024, eq. 8): gradients, added to others, and
// the sums themselves.
#ifndef FS_KERNELS_REGULARISE_H
#define FS_KERNELS_REGULARISE_H

#include <stddef.h>

typedef struct RegulariseKernels {
    // weight * sum sigmoid(x): d += weight s (1 - s); returns the sum.
    double (*sigmoid)(const float *x, size_t n, float weight, float *d);
    // weight * sum e^x: d += weight e^x; returns the sum.
    double (*exp)(const float *x, size_t n, float weight, float *d);
} RegulariseKernels;

extern const RegulariseKernels fs_regularise_scalar, fs_regularise_avx2, fs_regularise_avx512, fs_regularise_neon;

#endif

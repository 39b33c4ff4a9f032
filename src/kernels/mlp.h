// A layer of a small network without biases, y = w x, for many samples at once. Samples lie side by side: x is
// (columns, stride), y (rows, stride), stride a multiple of FS_MLP_PAD; all of the padding is computed too.
#ifndef FS_KERNELS_MLP_H
#define FS_KERNELS_MLP_H

#include <stdbool.h>
#include <stddef.h>

enum { FS_MLP_PAD = 32 };

typedef struct MlpLayer {
    const float *w; // (rows, columns); rows a multiple of 4
    int rows, columns;
    size_t stride; // samples
} MlpLayer;

typedef struct MlpKernels {
    void (*forward)(const MlpLayer *layer, bool rectify, const float *x, float *y); // rectify: y below 0 is 0
    // d_x = w^T d_y (columns a multiple of 4); where x is given, which was rectified, d_x is 0 where x is.
    void (*back)(const MlpLayer *layer, const float *d_y, const float *x, float *d_x);
    void (*weights)(const MlpLayer *layer, const float *d_y, const float *x, float *d_w); // d_w += d_y x^T
} MlpKernels;

extern const MlpKernels fs_mlp_scalar, fs_mlp_avx2, fs_mlp_avx512, fs_mlp_neon;

#endif

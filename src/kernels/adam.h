// Adam (Kingma and Ba 2015), one step:
//
//   m = b1 m + (1 - b1) g,  v = b2 v + (1 - b2) g^2,  x -= lr (m / (1 - b1^t)) / (sqrt(v / (1 - b2^t)) + eps)
#ifndef FS_KERNELS_ADAM_H
#define FS_KERNELS_ADAM_H

#include <math.h>
#include <stddef.h>

#define FS_ADAM_BETA1 0.9f
#define FS_ADAM_BETA2 0.999f
#define FS_ADAM_EPSILON 1e-15f

typedef struct AdamRate {
    float rate;  // lr / (1 - b1^t)
    float scale; // 1 / sqrt(1 - b2^t)
} AdamRate;

static inline AdamRate fs_adam_rate(double lr, long step) // step: 1 for the first
{
    double t = (double)step;
    return (AdamRate){(float)(lr / (1 - pow(0.9, t))), (float)(1 / sqrt(1 - pow(0.999, t)))};
}

typedef struct AdamFields {
    float *x;
    const float *grad;
    float *m, *v; // moments
} AdamFields;

typedef struct AdamKernels {
    void (*step)(const AdamFields *fields, size_t n, AdamRate rate);
    // Fields of (rows, width). Rows whose `visible` is 0 got no gradient: they and their moments stay.
    void (*step_sparse)(const AdamFields *fields, size_t rows, int width, const unsigned char *visible, AdamRate rate);
} AdamKernels;

extern const AdamKernels fs_adam_scalar, fs_adam_avx2, fs_adam_avx512, fs_adam_neon;

#endif

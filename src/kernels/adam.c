#include "kernels/adam.h"

static void step_range(float *x, const float *grad, float *m, float *v, size_t n, AdamRate rate)
{
    for (size_t i = 0; i < n; i++) {
        float g = grad[i];
        m[i] = FS_ADAM_BETA1 * m[i] + (1 - FS_ADAM_BETA1) * g;
        v[i] = FS_ADAM_BETA2 * v[i] + (1 - FS_ADAM_BETA2) * (g * g);
        x[i] -= rate.rate * m[i] / (sqrtf(v[i]) * rate.scale + FS_ADAM_EPSILON);
    }
}

static void step_sparse(float *x, const float *grad, float *m, float *v, size_t rows, int width,
                        const unsigned char *visible, AdamRate rate)
{
    size_t w = (size_t)width;
    for (size_t r = 0; r < rows; r++)
        if (visible[r]) step_range(x + r * w, grad + r * w, m + r * w, v + r * w, w, rate);
}

const AdamKernels fs_adam_scalar = {step_range, step_sparse};

#include "kernels/adam.h"

static void step_range(const AdamFields *fields, size_t begin, size_t n, AdamRate rate)
{
    float *x = fields->x + begin, *m = fields->m + begin, *v = fields->v + begin;
    for (size_t i = 0; i < n; i++) {
        float g = fields->grad[begin + i];
        m[i] = FS_ADAM_BETA1 * m[i] + (1 - FS_ADAM_BETA1) * g;
        v[i] = FS_ADAM_BETA2 * v[i] + (1 - FS_ADAM_BETA2) * (g * g);
        x[i] -= rate.rate * m[i] / (sqrtf(v[i]) * rate.scale + FS_ADAM_EPSILON);
    }
}

static void step(const AdamFields *fields, size_t n, AdamRate rate)
{
    step_range(fields, 0, n, rate);
}

static void step_sparse(const AdamFields *fields, size_t rows, int width, const unsigned char *visible, AdamRate rate)
{
    size_t w = (size_t)width;
    for (size_t r = 0; r < rows; r++)
        if (visible[r]) step_range(fields, r * w, w, rate);
}

const AdamKernels fs_adam_scalar = {step, step_sparse};

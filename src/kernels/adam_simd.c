// Written once for AVX2, AVX-512 and NEON; see simd.h.
#include "kernels/adam.h"
#include "kernels/simd.h"

// One vector of parameters; lanes outside `lanes` stay as they are.
INLINE void step_v(float *x, const float *grad, float *m, float *v, vm lanes, AdamRate rate)
{
    vf g = v_load(grad), m0 = v_load(m), v0 = v_load(v), x0 = v_load(x);
    vf m1 = v_fma(v_set(FS_ADAM_BETA1), m0, v_set(1 - FS_ADAM_BETA1) * g);
    vf v1 = v_fma(v_set(FS_ADAM_BETA2), v0, v_set(1 - FS_ADAM_BETA2) * (g * g));
    vf x1 = x0 - v_set(rate.rate) * m1 / v_fma(v_sqrt(v1), v_set(rate.scale), v_set(FS_ADAM_EPSILON));
    v_store(m, v_sel(lanes, m1, m0));
    v_store(v, v_sel(lanes, v1, v0));
    v_store(x, v_sel(lanes, x1, x0));
}

INLINE void step_range(const AdamFields *fields, size_t begin, size_t n, AdamRate rate)
{
    float *x = fields->x, *m = fields->m, *v = fields->v;
    const float *grad = fields->grad;
    size_t i = begin, end = begin + n;
    for (; i + VW <= end; i += VW) step_v(x + i, grad + i, m + i, v + i, vm_first(VW), rate);
    if (i == end) return;
    float tail[4][VW] = {0}; // the arrays may end here: work on a copy
    size_t bytes = (end - i) * sizeof(float);
    memcpy(tail[0], x + i, bytes);
    memcpy(tail[1], grad + i, bytes);
    memcpy(tail[2], m + i, bytes);
    memcpy(tail[3], v + i, bytes);
    step_v(tail[0], tail[1], tail[2], tail[3], vm_first(VW), rate);
    memcpy(x + i, tail[0], bytes);
    memcpy(m + i, tail[2], bytes);
    memcpy(v + i, tail[3], bytes);
}

static void step(const AdamFields *fields, size_t n, AdamRate rate)
{
    step_range(fields, 0, n, rate);
}

enum { GROUP = 16, MAX_WIDTH = 4 }; // rows looked at together; GROUP * width is a multiple of VW

static void step_group(const AdamFields *fields, size_t row, int width, const unsigned char *visible, AdamRate rate)
{
    size_t at = row * (size_t)width;
    float *x = fields->x + at, *m = fields->m + at, *v = fields->v + at;
    const float *grad = fields->grad + at;
    float flag[GROUP * MAX_WIDTH];
    for (int r = 0; r < GROUP; r++)
        for (int j = 0; j < width; j++) flag[r * width + j] = visible[row + (size_t)r];
    for (int i = 0; i < GROUP * width; i += VW)
        step_v(x + i, grad + i, m + i, v + i, v_lt(v_set(0), v_load(flag + i)), rate);
}

static void step_sparse(const AdamFields *fields, size_t rows, int width, const unsigned char *visible, AdamRate rate)
{
    size_t r = 0, w = (size_t)width;
    for (; width <= MAX_WIDTH && r + GROUP <= rows; r += GROUP) {
        uint64_t bytes[2];
        memcpy(bytes, visible + r, sizeof bytes);
        if (bytes[0] | bytes[1]) step_group(fields, r, width, visible, rate);
    }
    for (; r < rows; r++)
        if (visible[r]) step_range(fields, r * w, w, rate);
}

const AdamKernels FS_SIMD_SUFFIX(fs_adam) = {step, step_sparse};

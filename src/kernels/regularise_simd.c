// Written once for AVX2, AVX-512 and NEON; see simd.h.
#include "kernels/regularise.h"
#include "kernels/simd.h"

// The value, and its slope.
INLINE vf sigmoid_of(vf x, vf *slope)
{
    vf s = v_set(1) / (v_set(1) + v_exp(v_set(0) - x));
    *slope = s * (v_set(1) - s);
    return s;
}
INLINE vf exp_of(vf x, vf *slope)
{
    return *slope = v_exp(x);
}

// The arrays may end amid the last vector: it is worked on in a copy.
#define ADD(name, function)                                                                                            \
    static double name(const float *x, size_t n, float weight, float *d)                                               \
    {                                                                                                                  \
        const vf w = v_set(weight);                                                                                    \
        vf slope, sum = v_set(0);                                                                                      \
        size_t i = 0;                                                                                                  \
        for (; i + VW <= n; i += VW) {                                                                                 \
            sum += function(v_load(x + i), &slope);                                                                    \
            v_store(d + i, v_fma(w, slope, v_load(d + i)));                                                            \
        }                                                                                                              \
        float tail[2][VW] = {0};                                                                                       \
        memcpy(tail[0], x + i, (n - i) * sizeof(float));                                                               \
        memcpy(tail[1], d + i, (n - i) * sizeof(float));                                                               \
        sum += v_where(vm_first((int)(n - i)), function(v_load(tail[0]), &slope));                                     \
        v_store(tail[1], v_fma(w, slope, v_load(tail[1])));                                                            \
        memcpy(d + i, tail[1], (n - i) * sizeof(float));                                                               \
        return (double)v_sum(sum);                                                                                     \
    }
ADD(add_sigmoid, sigmoid_of)
ADD(add_exp, exp_of)

const RegulariseKernels FS_SIMD_SUFFIX(fs_regularise) = {add_sigmoid, add_exp};

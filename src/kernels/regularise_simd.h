// Written once for AVX2, AVX-512 and NEON; see simd.h.
#include "kernels/regularise.h"
#include "kernels/simd.h"

INLINE vf slope_of_sigmoid(vf x)
{
    vf s = v_set(1) / (v_set(1) + v_exp(v_set(0) - x));
    return s * (v_set(1) - s);
}
INLINE vf slope_of_exp(vf x)
{
    return v_exp(x);
}

// The arrays may end amid the last vector: it is worked on in a copy.
#define ADD(name, slope)                                                                                               \
    static void name(const float *x, size_t n, float weight, float *d)                                                 \
    {                                                                                                                  \
        const vf w = v_set(weight);                                                                                    \
        size_t i = 0;                                                                                                  \
        for (; i + VW <= n; i += VW) v_store(d + i, v_fma(w, slope(v_load(x + i)), v_load(d + i)));                    \
        float tail[2][VW] = {0};                                                                                       \
        memcpy(tail[0], x + i, (n - i) * sizeof(float));                                                               \
        memcpy(tail[1], d + i, (n - i) * sizeof(float));                                                               \
        v_store(tail[1], v_fma(w, slope(v_load(tail[0])), v_load(tail[1])));                                           \
        memcpy(d + i, tail[1], (n - i) * sizeof(float));                                                               \
    }
ADD(add_sigmoid, slope_of_sigmoid)
ADD(add_exp, slope_of_exp)

const RegulariseKernels FS_SIMD_SUFFIX(fs_regularise) = {add_sigmoid, add_exp};

// v_exp, v_log and v_pow of simd.h over arrays, compiled once per instruction set for test_vmath.
#ifndef TESTS_KERNELS_VMATH_H
#define TESTS_KERNELS_VMATH_H

typedef struct Vmath {
    void (*exp)(const float *x, float *out, int n); // n a multiple of 16
    void (*log)(const float *x, float *out, int n);
    void (*pow)(const float *x, float exponent, float *out, int n);
    // 0 where every other word of simd.h does what its comment says, else the number of the first that does not
    int (*words)(void);
} Vmath;
extern const Vmath vmath_avx2, vmath_avx512, vmath_neon;

#endif

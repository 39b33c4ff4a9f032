// One vocabulary for the SIMD twins of the kernels. Their files, <k>_simd.c, are written
// once in these words and compiled for each instruction set.
//
//   VW       floats in a vector            vf, vi   vectors of float, int32
//   vm       mask (one truth per lane)     + - * /  work on vf and vi as they are
#ifndef FS_KERNELS_SIMD_H
#define FS_KERNELS_SIMD_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__)
#include <immintrin.h>
#define VW 16
#define FS_SIMD_SUFFIX(name) name##_avx512
#elif defined(__AVX2__)
#include <immintrin.h>
#define VW 8
#define FS_SIMD_SUFFIX(name) name##_avx2
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#define VW 4
#define FS_SIMD_SUFFIX(name) name##_neon
#else
#error "simd.h: compile for AVX2+FMA, AVX-512 or NEON"
#endif

typedef float vf __attribute__((vector_size(4 * VW)));
typedef int32_t vi __attribute__((vector_size(4 * VW)));
#define INLINE static inline __attribute__((always_inline, unused))

INLINE vf v_load(const float *p) // any alignment
{
    vf v;
    memcpy(&v, p, sizeof v);
    return v;
}
INLINE void v_store(float *p, vf v)
{
    memcpy(p, &v, sizeof v);
}

// clang-format off
#if VW == 16
typedef __mmask16 vm;
INLINE vf v_set(float x) { return (vf)_mm512_set1_ps(x); }
INLINE vi v_seti(int32_t x) { return (vi)_mm512_set1_epi32(x); }
INLINE vf v_fma(vf a, vf b, vf c) { return (vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c); } // a*b + c
INLINE vf v_max(vf a, vf b) { return (vf)_mm512_max_ps((__m512)a, (__m512)b); }
INLINE vf v_min(vf a, vf b) { return (vf)_mm512_min_ps((__m512)a, (__m512)b); }
INLINE vf v_round(vf a) { return (vf)_mm512_roundscale_ps((__m512)a, 8); }
INLINE vi v_to_int(vf a) { return (vi)_mm512_cvtps_epi32((__m512)a); } // nearest
INLINE vf v_from_int(vi a) { return (vf)_mm512_cvtepi32_ps((__m512i)a); }
INLINE vi v_shift_left(vi a, int n) { return (vi)_mm512_slli_epi32((__m512i)a, (unsigned)n); }
INLINE vi v_shift_right(vi a, int n) { return (vi)_mm512_srai_epi32((__m512i)a, (unsigned)n); }
INLINE vf v_sqrt(vf a) { return (vf)_mm512_sqrt_ps((__m512)a); }
INLINE vm v_lt(vf a, vf b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ); }
INLINE vm v_le(vf a, vf b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LE_OQ); }
INLINE vm vm_and(vm a, vm b) { return a & b; }
INLINE vm vm_or(vm a, vm b) { return a | b; }
INLINE vm vm_andnot(vm a, vm b) { return a & (vm)~b; } // a and not b
INLINE int vm_any(vm a) { return a != 0; }
INLINE unsigned vm_bits(vm a) { return a; } // bit i: lane i
INLINE vm vm_first(int n) { return (vm)(n >= 16 ? 0xffff : (1u << (n < 0 ? 0 : n)) - 1); } // lanes 0..n-1
INLINE vf v_sel(vm m, vf a, vf b) { return (vf)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a); } // m ? a : b
INLINE vf v_where(vm m, vf a) { return (vf)_mm512_maskz_mov_ps(m, (__m512)a); }                 // m ? a : 0
INLINE float v_sum(vf a) { return _mm512_reduce_add_ps((__m512)a); }
#elif VW == 8
typedef __m256 vm;
INLINE vf v_set(float x) { return (vf)_mm256_set1_ps(x); }
INLINE vi v_seti(int32_t x) { return (vi)_mm256_set1_epi32(x); }
INLINE vf v_fma(vf a, vf b, vf c) { return (vf)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c); }
INLINE vf v_max(vf a, vf b) { return (vf)_mm256_max_ps((__m256)a, (__m256)b); }
INLINE vf v_min(vf a, vf b) { return (vf)_mm256_min_ps((__m256)a, (__m256)b); }
INLINE vf v_round(vf a) { return (vf)_mm256_round_ps((__m256)a, 8); }
INLINE vi v_to_int(vf a) { return (vi)_mm256_cvtps_epi32((__m256)a); }
INLINE vf v_from_int(vi a) { return (vf)_mm256_cvtepi32_ps((__m256i)a); }
INLINE vi v_shift_left(vi a, int n) { return (vi)_mm256_slli_epi32((__m256i)a, n); }
INLINE vi v_shift_right(vi a, int n) { return (vi)_mm256_srai_epi32((__m256i)a, n); }
INLINE vf v_sqrt(vf a) { return (vf)_mm256_sqrt_ps((__m256)a); }
INLINE vm v_lt(vf a, vf b) { return _mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ); }
INLINE vm v_le(vf a, vf b) { return _mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LE_OQ); }
INLINE vm vm_and(vm a, vm b) { return _mm256_and_ps(a, b); }
INLINE vm vm_or(vm a, vm b) { return _mm256_or_ps(a, b); }
INLINE vm vm_andnot(vm a, vm b) { return _mm256_andnot_ps(b, a); }
INLINE int vm_any(vm a) { return _mm256_movemask_ps(a) != 0; }
INLINE unsigned vm_bits(vm a) { return (unsigned)_mm256_movemask_ps(a); }
INLINE vm vm_first(int n)
{
    return (vm)_mm256_cmpgt_epi32(_mm256_set1_epi32(n), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}
INLINE vf v_sel(vm m, vf a, vf b) { return (vf)_mm256_blendv_ps((__m256)b, (__m256)a, m); }
INLINE vf v_where(vm m, vf a) { return (vf)_mm256_and_ps(m, (__m256)a); }
INLINE float v_sum(vf a)
{
    __m128 s = _mm_add_ps(_mm256_castps256_ps128((__m256)a), _mm256_extractf128_ps((__m256)a, 1));
    s = _mm_add_ps(s, _mm_movehl_ps(s, s));
    return _mm_cvtss_f32(_mm_add_ss(s, _mm_shuffle_ps(s, s, 1)));
}
#else
typedef uint32x4_t vm;
INLINE vf v_set(float x) { return (vf)vdupq_n_f32(x); }
INLINE vi v_seti(int32_t x) { return (vi)vdupq_n_s32(x); }
INLINE vf v_fma(vf a, vf b, vf c) { return (vf)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b); }
INLINE vf v_max(vf a, vf b) { return (vf)vmaxq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE vf v_min(vf a, vf b) { return (vf)vminq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE vf v_round(vf a) { return (vf)vrndnq_f32((float32x4_t)a); }
INLINE vi v_to_int(vf a) { return (vi)vcvtnq_s32_f32((float32x4_t)a); }
INLINE vf v_from_int(vi a) { return (vf)vcvtq_f32_s32((int32x4_t)a); }
INLINE vi v_shift_left(vi a, int n) { return (vi)vshlq_s32((int32x4_t)a, vdupq_n_s32(n)); }
INLINE vi v_shift_right(vi a, int n) { return (vi)vshlq_s32((int32x4_t)a, vdupq_n_s32(-n)); }
INLINE vf v_sqrt(vf a) { return (vf)vsqrtq_f32((float32x4_t)a); }
INLINE vm v_lt(vf a, vf b) { return vcltq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE vm v_le(vf a, vf b) { return vcleq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE vm vm_and(vm a, vm b) { return vandq_u32(a, b); }
INLINE vm vm_or(vm a, vm b) { return vorrq_u32(a, b); }
INLINE vm vm_andnot(vm a, vm b) { return vbicq_u32(a, b); }
INLINE int vm_any(vm a) { return vmaxvq_u32(a) != 0; }
INLINE unsigned vm_bits(vm a)
{
    static const uint32_t bit[4] = {1, 2, 4, 8};
    return vaddvq_u32(vandq_u32(a, vld1q_u32(bit)));
}
INLINE vm vm_first(int n)
{
    static const int32_t lane[4] = {0, 1, 2, 3};
    return vcgtq_s32(vdupq_n_s32(n), vld1q_s32(lane));
}
INLINE vf v_sel(vm m, vf a, vf b) { return (vf)vbslq_f32(m, (float32x4_t)a, (float32x4_t)b); }
INLINE vf v_where(vm m, vf a) { return (vf)vandq_u32(m, (uint32x4_t)a); }
INLINE float v_sum(vf a) { return vaddvq_f32((float32x4_t)a); }
#endif

INLINE vf v_floor(vf a)
{
#if VW == 16
    return (vf)_mm512_roundscale_ps((__m512)a, 9);
#elif VW == 8
    return (vf)_mm256_floor_ps((__m256)a);
#else
    return (vf)vrndmq_f32((float32x4_t)a);
#endif
}

// p[0], p[stride], ...: n of them, the lanes beyond are 0.
INLINE vf v_column(const float *p, int stride, int n)
{
#if VW == 16
    const __m512i at = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return (vf)_mm512_mask_i32gather_ps(_mm512_setzero_ps(), vm_first(n),
                                        _mm512_mullo_epi32(at, _mm512_set1_epi32(stride)), p, 4);
#else
#if VW == 8
    const size_t s = (size_t)stride;
    if (n >= 8) // a store a lane and one load of them all would wait for each other
        return (vf)_mm256_setr_ps(p[0], p[s], p[2 * s], p[3 * s], p[4 * s], p[5 * s], p[6 * s], p[7 * s]);
#endif
    float column[VW] = {0};
    for (int l = 0; l < VW && l < n; l++) column[l] = p[(size_t)l * (size_t)stride];
    return v_load(column);
#endif
}

INLINE vf v_abs(vf a) { return (vf)((vi)a & v_seti(0x7fffffff)); }
// clang-format on
INLINE vf v_copysign(vf magnitude, vf sign)
{
    return (vf)(((vi)magnitude & v_seti(0x7fffffff)) | ((vi)sign & v_seti((int32_t)0x80000000)));
}

// e^x for x in [-87, 88] (clamped): relative error under 2e-7 (Cody-Waite reduction, degree-6 minimax polynomial).
INLINE vf v_exp(vf x)
{
    x = v_min(v_max(x, v_set(-87.0f)), v_set(88.0f));
    vf n = v_round(x * v_set(1.44269504f));
    vf r = v_fma(n, v_set(-0.693359375f), x);
    r = v_fma(n, v_set(2.12194440e-4f), r);
    vf p = v_set(1.9875691500e-4f);
    p = v_fma(p, r, v_set(1.3981999507e-3f));
    p = v_fma(p, r, v_set(8.3334519073e-3f));
    p = v_fma(p, r, v_set(4.1665795894e-2f));
    p = v_fma(p, r, v_set(1.6666665459e-1f));
    p = v_fma(p, r, v_set(5.0000001201e-1f));
    p = v_fma(p, r * r, r + v_set(1.0f));
    return (vf)((vi)p + v_shift_left(v_to_int(n), 23));
}

// ln x for normal x > 0: relative error under 2e-7 (least-maximum polynomial of ln(1 + m) on [-1/3, 1/3]).
INLINE vf v_log(vf x)
{
    vi bits = (vi)x;
    vi e = v_shift_right(bits - v_seti(0x3f2aaaab), 23);
    vf m = (vf)(bits - v_shift_left(e, 23)) - v_set(1.0f); // in [-1/3, 1/3]
    vf p = v_set(0.13820135593414307f);
    p = v_fma(p, m, v_set(-0.15122190117836f));
    p = v_fma(p, m, v_set(0.14042328298091888f));
    p = v_fma(p, m, v_set(-0.1647232472896576f));
    p = v_fma(p, m, v_set(0.20007918775081635f));
    p = v_fma(p, m, v_set(-0.2500423789024353f));
    p = v_fma(p, m, v_set(0.3333326578140259f));
    p = v_fma(p, m, v_set(-0.5f));
    vf y = v_fma(p, m * m, m), n = v_from_int(e);
    return v_fma(n, v_set(0.693359375f), v_fma(n, v_set(-2.12194440e-4f), y));
}

INLINE vf v_pow(vf x, float exponent) // x > 0
{
    return v_exp(v_log(x) * v_set(exponent));
}

#endif

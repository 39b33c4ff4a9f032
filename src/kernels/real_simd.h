// The words of real_scalar.h over vectors: one pixel per lane.
#ifndef FS_KERNELS_REAL_SIMD_H
#define FS_KERNELS_REAL_SIMD_H

#include "kernels/simd.h"

#define FN INLINE
#define LANES VW
typedef vf real;

FN real r_lanes(void)
{
    float x[VW];
    for (int l = 0; l < VW; l++) x[l] = (float)l;
    return v_load(x);
}
// clang-format off
FN real r_set(float x) { return v_set(x); }
FN real r_load(const float *p) { return v_load(p); }
FN void r_store(float *p, real x) { v_store(p, x); }
FN float r_sum(real x) { return v_sum(x); }
FN real r_sqrt(real x) { return v_sqrt(x); }
FN real r_abs(real x) { return v_abs(x); }
FN real r_min(real a, real b) { return v_min(a, b); }
FN real r_max(real a, real b) { return v_max(a, b); }
FN real r_below(real a, real limit, real b) { return v_where(v_lt(a, limit), b); }
// clang-format on

#endif

// The words that *_body.h are written in, for the scalar definition: one pixel at a time. real_simd.h has the same for
// vectors.
#ifndef FS_KERNELS_REAL_SCALAR_H
#define FS_KERNELS_REAL_SCALAR_H

#include <math.h>

#define FN static inline
#define LANES 1
typedef float real;

// clang-format off
FN real r_set(float x) { return x; }
FN real r_lanes(void) { return 0; }
FN real r_load(const float *p) { return *p; }
FN void r_store(float *p, real x) { *p = x; }
FN float r_sum(real x) { return x; }
FN real r_sqrt(real x) { return sqrtf(x); }
FN real r_abs(real x) { return x < 0 ? -x : x; }
FN real r_min(real a, real b) { return a < b ? a : b; }
FN real r_max(real a, real b) { return a > b ? a : b; }
FN real r_below(real a, real limit, real b) { return a < limit ? b : 0; }
// clang-format on

#endif

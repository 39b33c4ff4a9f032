// SIMD twin of shade.c: one Gaussian per lane.
#include "kernels/shade.h"

#include "kernels/simd.h"

#define FN INLINE
#define LANES VW
typedef vf real;

// clang-format off
FN real r_set(float x) { return v_set(x); }
FN real r_exp(real x) { return v_exp(x); }
FN real r_pow(real x, float e) { return v_pow(x, e); }
FN real r_max(real a, real b) { return v_max(a, b); }
FN float r_sum(real a) { return v_sum(a); }
FN real r_column(const float *p, int stride, int n) { return v_column(p, stride, n); }
FN float get(const real *v, int lane) { return ((const float *)v)[lane]; }
// clang-format on

#include "kernels/shade_body.h"

const ShadeKernels FS_SIMD_SUFFIX(fs_shade) = {forward, backward, enter, leave};

// SIMD twin of shade.c: one Gaussian per lane.
#include "kernels/shade.h"

#include <stddef.h>

#include "kernels/simd.h"

#define FN INLINE
#define LANES VW
typedef vf real;

// clang-format off
FN real r_set(float x) { return v_set(x); }
FN real r_exp(real x) { return v_exp(x); }
FN real r_pow(real x, float e) { return v_pow(x, e); }
FN real r_max(real a, real b) { return v_max(a, b); }
FN void put(real *v, int lane, float x) { ((float *)v)[lane] = x; }
FN float get(const real *v, int lane) { return ((const float *)v)[lane]; }
// clang-format on

#include "kernels/shade_body.h"

const ShadeKernels FS_SIMD_SUFFIX(fs_shade) = {forward, backward, enter, leave};

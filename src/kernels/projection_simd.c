// SIMD twin of projection.c: one Gaussian per lane.
#include "kernels/projection.h"

#include <stdbool.h>

#include "kernels/simd.h"

#define FN INLINE
#define LANES VW
typedef vf real;

// clang-format off
FN real r_set(float x) { return v_set(x); }
FN real r_sqrt(real x) { return v_sqrt(x); }
FN real r_exp(real x) { return v_exp(x); }
FN real r_log2(real x) { return v_log(x) * v_set(1.44269504f); }
FN real r_max(real a, real b) { return v_max(a, b); }
FN real r_floor(real a) { return v_floor(a); }
FN real r_min(real a, real b) { return v_min(a, b); }
FN real r_where(real a, real limit, real b) { return v_where(v_le(v_abs(a), limit), b); }
FN real r_column(const float *p, int stride, int n) { return v_column(p, stride, n); }
FN float get(const real *v, int lane) { return ((const float *)v)[lane]; }
// clang-format on

#include "kernels/projection_body.h"
#include "kernels/projection_io.h"

const ProjectKernels FS_SIMD_SUFFIX(fs_project) = {forward, backward};

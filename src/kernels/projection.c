// Scalar definition of the projection. REAL can be double, for gradient checks.
#include "kernels/projection.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#ifndef REAL
#define REAL float
#endif
#define FN static inline
#define LANES 1
typedef REAL real;

// clang-format off
FN real r_set(float x) { return (real)x; }
FN real r_sqrt(real x) { return (real)sqrt((double)x); }
FN real r_exp(real x) { return (real)exp((double)x); }
FN real r_log2(real x) { return (real)log2((double)x); }
FN real r_max(real a, real b) { return a > b ? a : b; }
FN real r_min(real a, real b) { return a < b ? a : b; }
FN real r_where(real a, real limit, real b) { return a <= limit && a >= -limit ? b : 0; }
FN real r_floor(real x) { return (real)floor((double)x); }
FN real r_column(const float *p, int stride, int n) { return (void)stride, (void)n, (real)*p; }
FN float get(const real *v, int lane) { return (float)v[lane]; }
// clang-format on

#include "kernels/projection_body.h"
#include "kernels/projection_io.h"

const ProjectKernels fs_project_scalar = {forward, backward};

// Scalar definition of the flash shading.
#include "kernels/shade.h"

#include <math.h>
#include <stddef.h>

#define FN static inline
#define LANES 1
typedef float real;

// clang-format off
FN real r_set(float x) { return x; }
FN real r_exp(real x) { return expf(x); }
FN real r_pow(real x, float e) { return powf(x, e); }
FN real r_max(real a, real b) { return a > b ? a : b; }
FN float r_sum(real x) { return x; }
FN real r_column(const float *p, int stride, int n) { return (void)stride, (void)n, *p; }
FN float get(const real *v, int lane) { return v[lane]; }
// clang-format on

#include "kernels/shade_body.h"

const ShadeKernels fs_shade_scalar = {forward, backward, enter, leave};

// Scalar definition of the calibration.
#include "kernels/calibration.h"

#define FN static inline
#define LANES 1
typedef float real;

// clang-format off
FN real r_set(float x) { return x; }
FN real r_lanes(void) { return 0; }
FN real r_load(const float *p) { return *p; }
FN void r_store(float *p, real x) { *p = x; }
FN float r_sum(real x) { return x; }
FN real r_abs(real x) { return x < 0 ? -x : x; }
FN real r_min(real a, real b) { return a < b ? a : b; }
FN real r_max(real a, real b) { return a > b ? a : b; }
FN real r_below(real a, real limit, real b) { return a < limit ? b : 0; }
// clang-format on

#include "kernels/calibration_body.h"

const CalibrationKernels fs_calibration_scalar = {forward, backward};

// SIMD twin of calibration.c: one pixel per lane.
#include "kernels/calibration.h"
#include "kernels/real_simd.h"

#include "kernels/calibration_body.h"

const CalibrationKernels FS_SIMD_SUFFIX(fs_calibration) = {forward, backward};

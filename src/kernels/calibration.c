// Scalar definition of the calibration.
#include "kernels/calibration.h"

#include "kernels/real_scalar.h"

#include "kernels/calibration_body.h"

const CalibrationKernels fs_calibration_scalar = {forward, backward};

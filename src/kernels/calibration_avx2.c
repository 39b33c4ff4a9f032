#include "kernels/calibration_simd.h"

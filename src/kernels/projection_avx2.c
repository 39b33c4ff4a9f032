#include "kernels/projection_simd.h"

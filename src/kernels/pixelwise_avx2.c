#include "kernels/pixelwise_simd.h"

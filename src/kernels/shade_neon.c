#include "kernels/shade_simd.h"

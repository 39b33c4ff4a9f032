#include "kernels/occlusion_simd.h"

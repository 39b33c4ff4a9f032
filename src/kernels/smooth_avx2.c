#include "kernels/smooth_simd.h" // compiled for AVX2

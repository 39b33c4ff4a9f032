#include "kernels/pearson_simd.h" // compiled for AVX2

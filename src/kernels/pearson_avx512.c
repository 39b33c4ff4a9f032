#include "kernels/pearson_simd.h" // compiled for AVX-512

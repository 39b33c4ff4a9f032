#include "kernels/smooth_simd.h" // compiled for AVX-512

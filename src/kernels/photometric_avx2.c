#include "kernels/photometric_simd.h" // compiled for AVX2

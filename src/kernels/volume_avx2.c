#include "kernels/volume_simd.h" // compiled for AVX2

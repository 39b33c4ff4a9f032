#include "kernels/volume_simd.h" // compiled for AVX-512

#include "kernels/photometric_simd.h" // compiled for AVX-512

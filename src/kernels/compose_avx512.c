#include "kernels/compose_simd.h" // compiled for AVX-512

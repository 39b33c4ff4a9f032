#include "kernels/compose_simd.h" // compiled for AVX2

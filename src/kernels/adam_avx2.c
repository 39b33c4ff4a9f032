#include "kernels/adam_simd.h" // compiled for AVX2

#include "kernels/mlp_simd.h" // compiled for AVX-512

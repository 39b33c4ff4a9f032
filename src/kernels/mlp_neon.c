#include "kernels/mlp_simd.h" // compiled for NEON

#include "kernels/hashgrid_simd.h" // compiled for AVX2

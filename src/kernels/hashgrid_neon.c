#include "kernels/hashgrid_simd.h" // compiled for NEON

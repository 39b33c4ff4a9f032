#include "kernels/photometric_simd.h" // compiled for NEON

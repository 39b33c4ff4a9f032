#include "kernels/volume_simd.h" // compiled for NEON

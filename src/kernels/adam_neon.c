#include "kernels/adam_simd.h" // compiled for NEON

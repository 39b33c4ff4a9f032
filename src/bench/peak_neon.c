#include "bench/peak_simd.h" // compiled for NEON

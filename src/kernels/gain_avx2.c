#include "kernels/gain_simd.h"

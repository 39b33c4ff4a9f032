#include "kernels/veil_simd.h"

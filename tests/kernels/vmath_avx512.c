#include "vmath_simd.h"

#include "kernels/regularise_simd.h"

#include "kernels/project_simd.h"

#include "kernels/raster_simd.h"

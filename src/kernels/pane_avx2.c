#include "kernels/pane_simd.h"

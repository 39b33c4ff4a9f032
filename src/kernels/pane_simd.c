// SIMD twin of pane.c: one pixel per lane.
#include "kernels/pane.h"
#include "kernels/real_simd.h"

#include "kernels/pane_body.h"

const PaneKernels FS_SIMD_SUFFIX(fs_pane) = {forward, backward};

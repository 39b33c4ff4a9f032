// Twins by the compiler; see simd.h for the suffix.
#include "kernels/occlusion.h"
#include "kernels/simd.h"

#include "kernels/occlusion_body.h"

const OcclusionKernels FS_SIMD_SUFFIX(fs_occlusion) = {forward, backward, open_cells, apart, differ};

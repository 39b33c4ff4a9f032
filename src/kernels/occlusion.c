// Scalar definition.
#include "kernels/occlusion.h"

#include "kernels/occlusion_body.h"

const OcclusionKernels fs_occlusion_scalar = {forward, backward, open_cells, apart, differ};

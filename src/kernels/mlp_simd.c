#include "kernels/mlp.h"
#include "kernels/real_simd.h"

#include "kernels/mlp_body.h"

const MlpKernels FS_SIMD_SUFFIX(fs_mlp) = {layer_forward, layer_back, layer_weights};

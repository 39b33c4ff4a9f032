// Scalar definition.
#include "kernels/mlp.h"

#include "kernels/real_scalar.h"

#include "kernels/mlp_body.h"

const MlpKernels fs_mlp_scalar = {layer_forward, layer_back, layer_weights};

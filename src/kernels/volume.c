// Scalar definition.
#include "kernels/volume.h"

#include "kernels/volume_body.h"

const VolumeKernels fs_volume_scalar = {thickness, thickness_backward, weights, weights_backward,
                                        spread,    spread_backward,    blend,   blend_backward};

// Twins by the compiler; see simd.h for the suffix.
#include "kernels/simd.h"
#include "kernels/volume.h"

#include "kernels/volume_body.h"

const VolumeKernels FS_SIMD_SUFFIX(fs_volume) = {thickness, thickness_backward, weights, weights_backward,
                                                 spread,    spread_backward,    blend,   blend_backward};

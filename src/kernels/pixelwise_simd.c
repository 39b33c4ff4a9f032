// Twins by the compiler; see simd.h for the suffix.
#include "kernels/pixelwise.h"
#include "kernels/simd.h"

#include "kernels/pixelwise_body.h"

const PixelwiseKernels FS_SIMD_SUFFIX(fs_pixelwise) = {sigmoid, sigmoid_backward, cover, cover_backward,
                                                       clipped, opaque,           apart};

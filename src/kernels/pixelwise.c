// Scalar definition.
#include "kernels/pixelwise.h"

#include "kernels/pixelwise_body.h"

const PixelwiseKernels fs_pixelwise_scalar = {sigmoid, sigmoid_backward, cover, cover_backward, clipped, opaque, apart};

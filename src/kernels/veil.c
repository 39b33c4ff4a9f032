// Scalar definition.
#include "kernels/veil.h"

#include "kernels/veil_body.h"

const VeilKernels fs_veil_scalar = {forward, backward};

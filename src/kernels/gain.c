// Scalar definition.
#include "kernels/gain.h"

#include "kernels/gain_body.h"

const GainKernels fs_gain_scalar = {smooth, push};

// Twins by the compiler; see simd.h for the suffix.
#include "kernels/gain.h"
#include "kernels/simd.h"

#include "kernels/gain_body.h"

const GainKernels FS_SIMD_SUFFIX(fs_gain) = {smooth, push};

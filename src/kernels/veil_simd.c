// Twins by the compiler; see simd.h for the suffix.
#include "kernels/simd.h"
#include "kernels/veil.h"

#include "kernels/veil_body.h"

const VeilKernels FS_SIMD_SUFFIX(fs_veil) = {forward, backward};

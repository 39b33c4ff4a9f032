// Twins by the compiler; see simd.h for the suffix.
#include "kernels/hashgrid.h"
#include "kernels/simd.h"

#include "kernels/hashgrid_body.h"

const HashgridKernels FS_SIMD_SUFFIX(fs_hashgrid) = {encode, scatter};

// Scalar definition.
#include "kernels/hashgrid.h"

#include "kernels/hashgrid_body.h"

const HashgridKernels fs_hashgrid_scalar = {encode, scatter};

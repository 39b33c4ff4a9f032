// Scalar definition of the pane.
#include "kernels/pane.h"

#include "kernels/real_scalar.h"

#include "kernels/pane_body.h"

const PaneKernels fs_pane_scalar = {forward, backward};

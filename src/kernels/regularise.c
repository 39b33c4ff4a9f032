// Scalar definition of the regularisers.
#include "kernels/regularise.h"

#include <math.h>

static void add_sigmoid(const float *x, size_t n, float weight, float *d)
{
    for (size_t i = 0; i < n; i++) {
        float s = 1 / (1 + expf(-x[i]));
        d[i] += weight * s * (1 - s);
    }
}

static void add_exp(const float *x, size_t n, float weight, float *d)
{
    for (size_t i = 0; i < n; i++) d[i] += weight * expf(x[i]);
}

const RegulariseKernels fs_regularise_scalar = {add_sigmoid, add_exp};

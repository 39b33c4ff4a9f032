// Scalar definition of the regularisers.
#include "kernels/regularise.h"

#include <math.h>

static double add_sigmoid(const float *x, size_t n, float weight, float *d)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        float s = 1 / (1 + expf(-x[i]));
        d[i] += weight * s * (1 - s);
        sum += (double)s;
    }
    return sum;
}

static double add_exp(const float *x, size_t n, float weight, float *d)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        float e = expf(x[i]);
        d[i] += weight * e;
        sum += (double)e;
    }
    return sum;
}

const RegulariseKernels fs_regularise_scalar = {add_sigmoid, add_exp};

// The linearity term (Flash-Splat, section 4): minus Pearson's correlation of two images in linear light, all
// channels flattened into one vector. With means mx, my, covariance c and variances vx, vy:
//
//   L = -c / sqrt((vx + e) (vy + e)),   dL/dx_i = -((y_i - my) / sqrt(...) - (-L) (x_i - mx) / (vx + e)) / n
//
// Two passes over the strips: sums, then (sums of all strips added up in strip order) gradient.
#ifndef FS_KERNELS_PEARSON_H
#define FS_KERNELS_PEARSON_H

#include <stdbool.h>

#include "kernels/planes.h"

#define FS_PEARSON_EPSILON 1e-8 // added to variances: an image of one colour has no say

typedef struct PearsonSums {
    double n, x, y, xx, yy, xy;
} PearsonSums;

typedef struct PearsonArgs {
    const Planes *X, *Y;               // (c, h, w) tone-mapped; only needed by gradient
    const Planes *X_linear, *Y_linear; // the same, decoded (compose.h)
    const Planes *d_X, *d_Y;           // added to: gradient in the tone-mapped values; NULL where not wanted
    float weight;
} PearsonArgs;

typedef struct PearsonKernels {
    PearsonSums (*sums)(const PearsonArgs *args, int y0, int y1);
    void (*gradient)(const PearsonArgs *args, const PearsonSums *total, int y0, int y1);
} PearsonKernels;

extern const PearsonKernels fs_pearson_scalar, fs_pearson_avx2, fs_pearson_avx512, fs_pearson_neon;

// What gradient needs of the sums, and the loss itself (not weighted).
typedef struct PearsonFit {
    double loss;
    double mean_x, mean_y;
    double a, bx, by; // dL/dx_i = a (y_i - mean_y) + bx (x_i - mean_x); dL/dy_i likewise
} PearsonFit;
PearsonFit fs_pearson_fit(const PearsonSums *total); // of the sums over all of the image

// The gradient of an image u against the other one, v: a (v - mean_v) + b (u - mean_u).
typedef struct PearsonLine {
    float a, b, mean_u, mean_v;
} PearsonLine;
static inline PearsonLine fs_pearson_line(const PearsonFit *fit, float weight, bool of_y)
{
    float a = (float)(weight * fit->a), mean_x = (float)fit->mean_x, mean_y = (float)fit->mean_y;
    return of_y ? (PearsonLine){a, (float)(weight * fit->by), mean_y, mean_x}
                : (PearsonLine){a, (float)(weight * fit->bx), mean_x, mean_y};
}

#endif

// Smoothness of the flash gain over the transmitted cloud: neighbouring Gaussians of one surface have nearly the same
// log gain, for alpha = flash light / ambient light depends on distance and angle to the flash, which vary slowly over
// a surface, while the surface's texture does not enter it. A robust (L1-like) penalty lets it bend at edges.
//
//   L = mean over i of mean over its K nearest neighbours j of phi(g_i - g_j),   phi(x) = sqrt(x^2 + e^2) - e
//
// As a graph: an edge of weight w between two Gaussians of which w (1 or 2) have the other among their nearest, so
//   L = 1 / (N K) * sum over edges of w phi,   dL/dg_i = 1 / (N K) * sum over i's edges of w phi'(g_i - g_j).
#ifndef FS_KERNELS_GAIN_H
#define FS_KERNELS_GAIN_H

#define FS_GAIN_EPSILON 0.05f

// Each edge stands with both its ends.
typedef struct GainGraph {
    const int *start;    // (N + 1) into other and weight
    const int *other;    // the other end
    const float *weight; // w
    double scale;        // 1 / (N K)
} GainGraph;

typedef struct GainKernels {
    // gains, d_gains (N, 1), for i in [begin, end): adds weight * dL/dg_i; returns these rows' part of L: half of their
    // edges.
    double (*smooth)(const GainGraph *graph, const float *gains, int begin, int end, float weight, float *d_gains);
    // Against gains below 0, of which there are few: what the flash hardly brightens is mirrored, unless the photos
    // insist. Adds the gradient of weight * sum of max(0, -g_i); returns the sum.
    double (*push)(const float *gains, int begin, int end, float weight, float *d_gains);
} GainKernels;

extern const GainKernels fs_gain_scalar, fs_gain_avx2, fs_gain_avx512, fs_gain_neon;

#endif

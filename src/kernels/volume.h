// Samples along a ray of a radiance field, each with the optical thickness tau of its part of the ray (Mildenhall et
// al. 2020, eq. 3), and what they weigh in what the ray shows:
//
//   w_i = T_i (1 - exp(-tau_i)),   T_i = exp(-sum of tau_j before i),   passes = T of all
//
// "Before" is nearer, or farther where the ray is followed from its far end (NeRFReN, Guo et al. 2022, section 3.3).
#ifndef FS_KERNELS_VOLUME_H
#define FS_KERNELS_VOLUME_H

#include <stdbool.h>

// A ray shows the sum of w_i values_i, of those samples that have values: `of` says which, in order.
typedef struct VolumeBlend {
    const float *w; // of all samples of the ray
    const int *of;  // (n)
    const float *x; // (channels, stride): values of those n
    int n, channels, stride;
} VolumeBlend;

typedef struct VolumeKernels {
    // tau = exp(logarithm), of n samples; backward: d_logarithm = d_tau tau.
    void (*thickness)(const float *logarithm, int n, float *tau);
    void (*thickness_backward)(const float *logarithm, const float *tau, const float *d_tau, int n, float *d_logarithm);
    float (*weights)(const float *tau, int n, bool from_far, float *w); // passes
    // d_w (n), d_passes: gradients; d_tau: added to.
    void (*weights_backward)(const float *w, int n, bool from_far, const float *d_w, float d_passes, float *d_tau);
    // How far apart the weights are (mip-NeRF 360, Barron et al. 2022, eq. 15): sum over i, j of w_i w_j |s_i - s_j|,
    // and a third of the sum of w_i^2 times the length of a step; s rises. Gradient: d_out times it is added to d_w.
    float (*spread)(const float *w, const float *s, int n, float step);
    void (*spread_backward)(const float *w, const float *s, int n, float step, float d_out, float *d_w);
    void (*blend)(const VolumeBlend *blend, float out[]);
    void (*blend_backward)(const VolumeBlend *blend, const float d_out[], float *d_x, float *d_w); // written; added to
} VolumeKernels;

#define FS_VOLUME_THICKEST 12.0f // logarithm; more is no thicker

extern const VolumeKernels fs_volume_scalar, fs_volume_avx2, fs_volume_avx512, fs_volume_neon;

#endif

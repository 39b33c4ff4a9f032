// The pane (model/scene.h: Pane) at every pixel of a view, forward and backward.
//
//   c = normal . ray / |ray|,   rho = min(1 + 22 (1 - |c|)^5, most / dimming),   ray = base + x dx + y dy
//   beta = R f0 rho,   tau = T (1 - dimming rho) / (1 - dimming)
#ifndef FS_KERNELS_PANE_H
#define FS_KERNELS_PANE_H

#include "base/optics.h"
#include "kernels/planes.h"

typedef struct PaneView {
    float base[3], dx[3], dy[3]; // ray of pixel (x, y) in the world, any length
    float normal[3];             // unit
    float f0, dimming, most;
    float T, R; // of this photo: factors on tau and beta, for light that was stronger or weaker than in the others
} PaneView;

typedef struct PaneGradient {
    double normal[3]; // of the normal's free directions
    double dimming;
    double T, R; // of the factors' logarithms
} PaneGradient;

typedef struct PaneKernels {
    // beta and tau (1 plane each) for rows [y0, y1).
    void (*forward)(const PaneView *view, const Planes *beta, const Planes *tau, int y0, int y1);
    // The part of rows [y0, y1) in the gradient, given dL/dbeta and dL/dtau.
    PaneGradient (*backward)(const PaneView *view, const Planes *d_beta, const Planes *d_tau, int y0, int y1);
} PaneKernels;

extern const PaneKernels fs_pane_scalar, fs_pane_avx2, fs_pane_avx512, fs_pane_neon;

#endif

// The image equation (Flash-Splat, section 3), forward and backward: a photo is formed in linear light and
// compared tone-mapped,
//
//   I = encode(tau * decode(T) + beta * decode(R) + veil),   decode(x) = x^(1/0.22),   encode(x) = x^0.22.
//
// Below DARK (tone-mapped) both functions go on as the straight line through 0 and (DARK, DARK^(1/0.22)): they stay
// each other's inverse on all numbers, black stays black, and the gradient of a dark colour is small but never nil,
// so that it can brighten again.
#ifndef FS_KERNELS_COMPOSE_H
#define FS_KERNELS_COMPOSE_H

#include "base/optics.h"
#include "kernels/planes.h"

#define FS_COMPOSE_GAMMA FS_OPTICS_GAMMA
#define FS_COMPOSE_DARK 0.03f
#define FS_COMPOSE_DARK_LINEAR 1.19625533e-7f                            // DARK^(1/0.22)
#define FS_COMPOSE_DARK_SLOPE (FS_COMPOSE_DARK_LINEAR / FS_COMPOSE_DARK) // of decode, below DARK

typedef struct ComposeArgs {
    const Planes *T, *R; // (3, h, w) tone-mapped
    const Planes *beta;  // (1, h, w) 0..1; NULL: 1 everywhere
    // Written by forward, read by backward.
    const Planes *I;                              // (3, h, w) tone-mapped
    const Planes *T_linear, *R_linear, *I_linear; // (3, h, w)
    // Backward.
    const Planes *d_I;                // (3, h, w) dL/dI
    const Planes *d_T, *d_R, *d_beta; // added to; NULL where not wanted
    float slope_floor; // decode's slope is taken as at least this: 0 is the true gradient; more lets a layer that went
                       // black in front of the other come back (its sign is right, its size is a preconditioner)
    const Planes *tau; // (1, h, w) what the pane lets through: T_linear = tau * decode(T); NULL: 1
    const Planes *d_tau;         // added to; NULL where not wanted
    const Planes *veil, *d_veil; // (3, h, w) linear light that the pane itself sends; its gradient, written; NULL: none
} ComposeArgs;

typedef struct ComposeKernels {
    void (*forward)(const ComposeArgs *args, int y0, int y1);
    void (*backward)(const ComposeArgs *args, int y0, int y1);
    // The conversion alone, for any number of channels; in place is allowed.
    void (*decode)(const Planes *toned, const Planes *linear, int y0, int y1);
} ComposeKernels;

extern const ComposeKernels fs_compose_scalar, fs_compose_avx2, fs_compose_avx512, fs_compose_neon;

#endif

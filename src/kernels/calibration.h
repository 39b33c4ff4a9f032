// What a camera makes of the light (photometric calibration), after the image equation and before the comparison with
// the photo; all tone-mapped (kernels/compose.h), per pixel and channel:
//
//   P = h(e^(0.22 white_c) V(u) I),   V = 1 + v0 u + v1 u^2 + v2 u^3 (at least LEAST),   u = (distance to the centre)^2
//
// V is the vignetting (V^(1/0.22) of the light arrives), white the photo's own factor a channel (white balance), and h
// the response that is left once the photo was linearised: the identity plus a straight line between knots,
//
//   h(q) = q + sum_k response_k max(0, 1 - |k - min(q / SPACING, KNOTS - 1)|).
//
// A photo that was brought to the others' exposure after it was linearised, its values times `exposure` (tone-mapped),
// met the response before: P = exposure h(q / exposure).
#ifndef FS_KERNELS_CALIBRATION_H
#define FS_KERNELS_CALIBRATION_H

#include "base/optics.h"
#include "kernels/planes.h"

typedef struct CalibrationView {
    float white[3]; // logarithms of factors in linear light
    float exposure; // tone-mapped; 0: 1
    float vignetting[FS_OPTICS_VIGNETTING];
    float cx, cy, per_px[2];         // the centre, pixels; u = 1 at a distance of 1 / per_px columns or rows
    float response[FS_OPTICS_KNOTS]; // tone-mapped; used where `curved`
    int curved;
} CalibrationView;

typedef struct CalibrationGradient {
    double white[3], vignetting[FS_OPTICS_VIGNETTING], response[FS_OPTICS_KNOTS];
} CalibrationGradient;

typedef struct CalibrationKernels {
    // P from I, (3, h, w) each, rows [y0, y1); in place is not allowed.
    void (*forward)(const CalibrationView *view, const Planes *I, const Planes *P, int y0, int y1);
    // dL/dI (written) from dL/dP; the part of the rows is added to the gradient.
    void (*backward)(const CalibrationView *view, const Planes *I, const Planes *d_P, const Planes *d_I, int y0, int y1,
                     CalibrationGradient *gradient);
} CalibrationKernels;

extern const CalibrationKernels fs_calibration_scalar, fs_calibration_avx2, fs_calibration_avx512, fs_calibration_neon;

#define FS_CALIBRATION_LEAST 0.05f // of V

#endif

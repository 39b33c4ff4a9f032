// The pane at every pixel of a view (scene.h: Pane): what it reflects, what it lets through, and their gradients.
#ifndef FS_ENGINE_PANE_H
#define FS_ENGINE_PANE_H

#include "kernels/planes.h"
#include "model/camera.h"
#include "model/scene.h"

// beta and tau (1 plane each) for rows [y0, y1).
void fs_pane_forward(const Pane *pane, const Camera *camera, const Planes *beta, const Planes *tau, int y0, int y1);

typedef struct PaneGradient {
    double normal[3]; // of the normal's free directions
    double dimming;
} PaneGradient;
// Adds rows [y0, y1)'s part, given dL/dbeta and dL/dtau.
void fs_pane_backward(const Pane *pane, const Camera *camera, const Planes *d_beta, const Planes *d_tau, int y0, int y1,
                      PaneGradient *gradient);

#endif

// The pane's reflectance at every pixel of a view (scene.h: Schlick's form of Fresnel's law), and its gradient.
#ifndef FS_ENGINE_PANE_H
#define FS_ENGINE_PANE_H

#include "kernels/planes.h"
#include "model/camera.h"
#include "model/scene.h"

// beta (1 plane) for rows [y0, y1).
void fs_pane_forward(const Pane *pane, const Camera *camera, const Planes *beta, int y0, int y1);
// Adds this strip's part of dL/dnormal (of the normalised normal's free direction) and dL/df0, given dL/dbeta.
void fs_pane_backward(const Pane *pane, const Camera *camera, const Planes *d_beta, int y0, int y1, double d_normal[3],
                      double *d_f0);

#endif

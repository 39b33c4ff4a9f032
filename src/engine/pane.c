#include "engine/pane.h"

#include <math.h>

PaneView fs_pane_view(const Pane *pane, const Camera *camera)
{
    const double *m = camera->w2c, *n = pane->normal;
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    PaneView v = {.f0 = (float)pane->f0, .dimming = (float)pane->dimming, .most = (float)FS_PANE_MOST};
    for (int k = 0; k < 3; k++) { // R^T K^-1 (x, y, 1)
        v.dx[k] = (float)(m[k] / camera->fx);
        v.dy[k] = (float)(m[4 + k] / camera->fy);
        v.base[k] =
            (float)(m[8 + k] + (0.5 - camera->cx) / camera->fx * m[k] + (0.5 - camera->cy) / camera->fy * m[4 + k]);
        v.normal[k] = (float)(n[k] / (length > 0 ? length : 1));
    }
    return v;
}

#include "model/vertical.h"

#include <math.h>

#include "base/linalg.h"

enum { TURNS = 100 };

// Row of w2c: the camera's x or y axis.
static int level_row(const Camera *camera, const double up[3])
{
    return fabs(v3_dot(camera->w2c + 4, up)) < fabs(v3_dot(camera->w2c, up)) ? 1 : 0;
}

void fs_vertical_lower(const Camera *camera, const double up[3], double lower[3])
{
    const double *side = camera->w2c + 4 * (1 - level_row(camera, up)), sign = v3_dot(side, up) > 0 ? -1 : 1;
    for (int k = 0; k < 3; k++) lower[k] = sign * side[k];
}

void fs_vertical_find(const View *const *views, int n, double up[3])
{
    for (int k = 0; k < 3; k++) up[k] = 0;
    for (int v = 0; v < n; v++)
        for (int k = 0; k < 3; k++) up[k] -= views[v]->camera.w2c[4 + k];
    v3_normalise(up);
    for (int turn = 0; turn < TURNS; turn++) {
        double off[3] = {0};
        for (int v = 0; v < n; v++) {
            const double *side = views[v]->camera.w2c + 4 * level_row(&views[v]->camera, up);
            for (int k = 0; k < 3; k++) off[k] += v3_dot(side, up) * side[k] / n;
        }
        for (int k = 0; k < 3; k++) up[k] -= 0.5 * off[k];
        v3_normalise(up);
    }
}

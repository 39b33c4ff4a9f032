#include "render/spiral.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"

#define TURNS 2
#define RISE 0.5        // turns of the forward-backward motion per turn of the circle
#define FAR_WEIGHT 0.75 // share of the far depth in the focus disparity
#define OFFSET_PERCENTILE 0.9

// Axes that look along forward with down as given but for the part along forward; false where they are parallel.
static bool make_axes(const double forward[3], const double down_hint[3], double right[3], double down[3])
{
    v3_cross(down_hint, forward, right); // y x z = x
    if (v3_normalise(right) < 1e-9) return false;
    v3_cross(forward, right, down);
    return true;
}

// Linear interpolation between order statistics, as numpy's percentile.
static double percentile(double *values, int n, double fraction)
{
    fs_order_doubles(values, (size_t)n);
    double at = fraction * (n - 1);
    int i = (int)at;
    return i + 1 < n ? values[i] + (at - i) * (values[i + 1] - values[i]) : values[n - 1];
}

static int fit_radii(Spiral *spiral, const Camera *cameras, int n, FsError *err)
{
    double *offset = malloc(sizeof *offset * (size_t)n);
    if (!offset) return fs_error_memory(err);
    const double *axes[3] = {spiral->right, spiral->down, spiral->forward};
    for (int a = 0; a < 3; a++) {
        for (int i = 0; i < n; i++) {
            double c[3];
            fs_camera_centre(&cameras[i], c);
            for (int k = 0; k < 3; k++) c[k] -= spiral->centre[k];
            offset[i] = fabs(v3_dot(c, axes[a]));
        }
        spiral->radius[a] = percentile(offset, n, OFFSET_PERCENTILE);
    }
    free(offset);
    return 0;
}

int fs_spiral_fit(Spiral *spiral, const Camera *cameras, int n, double nearest, double farthest, FsError *err)
{
    *spiral = (Spiral){0};
    if (n < 1) return fs_error_input(err, "camera path: no posed photos to make it from");
    if (!(nearest > 0) || !(farthest >= nearest) || !isfinite(farthest))
        return fs_error_input(err, "camera path: scene depths %g to %g, expected positive and rising", nearest,
                              farthest);
    double down[3] = {0};
    for (int i = 0; i < n; i++) {
        double c[3];
        fs_camera_centre(&cameras[i], c);
        for (int k = 0; k < 3; k++) {
            spiral->centre[k] += c[k] / n;
            down[k] += cameras[i].w2c[4 + k]; // rows of the rotation are the camera's axes in the world
            spiral->forward[k] += cameras[i].w2c[8 + k];
        }
    }
    if (v3_normalise(spiral->forward) < 1e-9 || !make_axes(spiral->forward, down, spiral->right, spiral->down))
        return fs_error_input(err, "camera path: the cameras look in opposite directions, a spiral needs a common one");
    double near_depth = 0.9 * nearest, far_depth = 5 * farthest;
    spiral->focus_depth = 1 / ((1 - FAR_WEIGHT) / near_depth + FAR_WEIGHT / far_depth);
    return fit_radii(spiral, cameras, n, err);
}

Camera fs_spiral_camera(const Spiral *spiral, const Camera *like, int i, int n)
{
    double angle = 2 * M_PI * TURNS * i / n;
    double offset[3] = {cos(angle) * spiral->radius[0], sin(angle) * spiral->radius[1],
                        sin(angle * RISE) * spiral->radius[2]};
    double position[3], forward[3], right[3], down[3];
    for (int k = 0; k < 3; k++) {
        position[k] = spiral->centre[k] + offset[0] * spiral->right[k] + offset[1] * spiral->down[k] +
                      offset[2] * spiral->forward[k];
        forward[k] = spiral->centre[k] + spiral->focus_depth * spiral->forward[k] - position[k];
    }
    v3_normalise(forward);
    if (!make_axes(forward, spiral->down, right, down)) make_axes(forward, spiral->right, right, down);
    Camera camera = *like;
    const double *axes[3] = {right, down, forward};
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) camera.w2c[4 * r + k] = axes[r][k];
        camera.w2c[4 * r + 3] = -v3_dot(axes[r], position);
    }
    return camera;
}

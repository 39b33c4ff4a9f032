#include "train/portrait_axes.h"

#include <math.h>
#include <string.h>

#include "base/linalg.h"
#include "engine/engine.h"
#include "model/vertical.h"
#include "train/train_constants.h"

// The part of a direction across the vertical; returns its length.
static double across_of(const double d[3], const double up[3], double level[3])
{
    double rise = v3_dot(d, up);
    for (int k = 0; k < 3; k++) level[k] = d[k] - rise * up[k];
    return v3_normalise(level);
}

// Where a photo looks, on the level: straight down, too, by which of its sides is the upper one.
static void facing(const Camera *camera, const double up[3], double front[3])
{
    const double *ahead = camera->w2c + 8, sign = v3_dot(ahead, up) < 0 ? -1 : 1;
    double d[3], lower[3];
    fs_vertical_lower(camera, up, lower);
    for (int k = 0; k < 3; k++) d[k] = ahead[k] + sign * lower[k];
    across_of(d, up, front);
}

static void across(PortraitAxes *axes, bool turned, const View *const *views, int n)
{
    double up[3], mean[3] = {0}, fronts[3] = {0}, front[3], level[3], length = 0;
    fs_vertical_find(views, n, up);
    for (int v = 0; v < n; v++) {
        const double *ahead = views[v]->camera.w2c + 8;
        facing(&views[v]->camera, up, front);
        length += across_of(ahead, up, level) / n;
        for (int k = 0; k < 3; k++) mean[k] += ahead[k] / n, fronts[k] += front[k];
    }
    if (!turned) length = across_of(mean, up, level);
    v3_normalise(fronts);
    for (int v = 0; v < n; v++) {
        PortraitAxes *a = &axes[v];
        memcpy(front, fronts, sizeof front);
        if (turned) facing(&views[v]->camera, up, front);
        for (int k = 0; k < 3; k++) a->ahead[k] = length * front[k] + v3_dot(mean, up) * up[k];
        v3_normalise(a->ahead);
        v3_cross(front, up, a->right);
        v3_normalise(a->right);
        v3_cross(a->right, a->ahead, a->up);
    }
}

// What is ahead by 1 moves by the camera's distance from their mean; what stands still is scaled to move so much.
static void shift(PortraitAxes *axes, const View *const *views, int n)
{
    double mean[3] = {0}, spread = 0;
    for (int v = 0; v < n; v++) {
        fs_camera_centre(&views[v]->camera, axes[v].shift);
        for (int k = 0; k < 3; k++) mean[k] += axes[v].shift[k] / n;
    }
    for (int v = 0; v < n; v++) {
        for (int k = 0; k < 3; k++) axes[v].shift[k] -= mean[k];
        spread += v3_dot(axes[v].shift, axes[v].shift) / n;
    }
    for (int v = 0; v < n; v++)
        for (int k = 0; k < 3; k++) axes[v].shift[k] *= PORTRAIT_PASSES / sqrt(spread);
}

void fs_portrait_axes_direct(PortraitAxes *axes, PortraitKind kind, const View *const *views, int n)
{
    memset(axes, 0, sizeof *axes * (size_t)n);
    across(axes, kind == PORTRAIT_TURNED, views, n);
    if (kind == PORTRAIT_STILL) shift(axes, views, n);
}

int fs_portrait_axes_cell(const PortraitAxes *a, const Camera *c, int cell)
{
    double x = (cell % OCCLUSION_WIDTH + 0.5) / OCCLUSION_WIDTH, y = (cell / OCCLUSION_WIDTH + 0.5) / OCCLUSION_HEIGHT;
    const double ray[3] = {(x * c->width - c->cx) / c->fx, (y * c->height - c->cy) / c->fy, 1};
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = ray[0] * c->w2c[k] + ray[1] * c->w2c[4 + k] + ray[2] * c->w2c[8 + k];
    double ahead = v3_dot(d, a->ahead);
    for (int k = 0; k < 3; k++) d[k] += ahead * a->shift[k];
    double z = PORTRAIT_REACH * v3_dot(d, a->ahead);
    double i = (v3_dot(d, a->right) / z + 1) / 2 * REGION_SIDE, j = (1 - v3_dot(d, a->up) / z) / 2 * REGION_SIDE;
    if (!(z > 0) || !(i >= 0) || !(i < REGION_SIDE) || !(j >= 0) || !(j < REGION_SIDE)) return -1;
    return (int)j * REGION_SIDE + (int)i;
}

double fs_portrait_axes_tilt(const View *const *views, int n)
{
    double up[3], sum = 0;
    fs_vertical_find(views, n, up);
    for (int v = 0; v < n; v++) sum += v3_dot(views[v]->camera.w2c + 8, up) / n;
    return fabs(sum);
}

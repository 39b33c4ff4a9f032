#include "engine/pane.h"

#include <math.h>

// Ray of a pixel in the world, unit length: R^T K^-1 (x, y, 1).
typedef struct Rays {
    float base[3], dx[3], dy[3]; // direction = base + x dx + y dy, not normalised
} Rays;

static Rays rays_of(const Camera *camera)
{
    Rays r;
    for (int k = 0; k < 3; k++) {
        const double *m = camera->w2c;
        r.dx[k] = (float)(m[k] / camera->fx);
        r.dy[k] = (float)(m[4 + k] / camera->fy);
        r.base[k] = (float)(m[8 + k] + (0.5 - camera->cx) / camera->fx * m[k] + (0.5 - camera->cy) / camera->fy * m[4 + k]);
    }
    return r;
}

static float cosine(const Rays *rays, const float n[3], int x, int y, float ray[3])
{
    float length2 = 0, dot = 0;
    for (int k = 0; k < 3; k++) {
        ray[k] = rays->base[k] + (float)x * rays->dx[k] + (float)y * rays->dy[k];
        length2 += ray[k] * ray[k];
    }
    float inv = 1 / sqrtf(length2);
    for (int k = 0; k < 3; k++) {
        ray[k] *= inv;
        dot += ray[k] * n[k];
    }
    return dot;
}

static void unit_normal(const Pane *pane, float n[3])
{
    double length = sqrt(pane->normal[0] * pane->normal[0] + pane->normal[1] * pane->normal[1] +
                         pane->normal[2] * pane->normal[2]);
    for (int k = 0; k < 3; k++) n[k] = (float)(pane->normal[k] / (length > 0 ? length : 1));
}

void fs_pane_forward(const Pane *pane, const Camera *camera, const Planes *beta, int y0, int y1)
{
    Rays rays = rays_of(camera);
    float n[3], ray[3], f0 = (float)pane->f0;
    unit_normal(pane, n);
    for (int y = y0; y < y1; y++) {
        float *row = fs_planes_row(beta, 0, y);
        for (int x = 0; x < beta->stride; x++) {
            float u = 1 - fabsf(cosine(&rays, n, x, y, ray)), u2 = u * u;
            row[x] = f0 + (1 - f0) * u2 * u2 * u;
        }
    }
}

void fs_pane_backward(const Pane *pane, const Camera *camera, const Planes *d_beta, int y0, int y1, double d_normal[3],
                      double *d_f0)
{
    Rays rays = rays_of(camera);
    float n[3], ray[3], f0 = (float)pane->f0;
    unit_normal(pane, n);
    for (int y = y0; y < y1; y++) {
        const float *row = fs_planes_row(d_beta, 0, y);
        double part[4] = {0};
        for (int x = 0; x < d_beta->width; x++) {
            float c = cosine(&rays, n, x, y, ray), u = 1 - fabsf(c), u2 = u * u, u4 = u2 * u2;
            float d_u = row[x] * (1 - f0) * 5 * u4, sign = c < 0 ? 1.0f : -1.0f; // du/dc
            for (int k = 0; k < 3; k++) part[k] += (double)(d_u * sign * (ray[k] - c * n[k]));
            part[3] += (double)(row[x] * (1 - u4 * u));
        }
        for (int k = 0; k < 3; k++) d_normal[k] += part[k];
        *d_f0 += part[3];
    }
}

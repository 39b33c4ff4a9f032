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
        r.base[k] =
            (float)(m[8 + k] + (0.5 - camera->cx) / camera->fx * m[k] + (0.5 - camera->cy) / camera->fy * m[4 + k]);
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
    double length =
        sqrt(pane->normal[0] * pane->normal[0] + pane->normal[1] * pane->normal[1] + pane->normal[2] * pane->normal[2]);
    for (int k = 0; k < 3; k++) n[k] = (float)(pane->normal[k] / (length > 0 ? length : 1));
}

void fs_pane_forward(const Pane *pane, const Camera *camera, const Planes *beta, const Planes *tau, int y0, int y1)
{
    Rays rays = rays_of(camera);
    float n[3], ray[3], f0 = (float)pane->f0, b = (float)pane->dimming, most = (float)FS_PANE_MOST;
    unit_normal(pane, n);
    for (int y = y0; y < y1; y++) {
        float *beta_row = fs_planes_row(beta, 0, y), *tau_row = fs_planes_row(tau, 0, y);
        for (int x = 0; x < beta->stride; x++) {
            float rho = (float)fs_pane_rho((double)cosine(&rays, n, x, y, ray));
            beta_row[x] = fminf(f0 * rho, most);
            tau_row[x] = (1 - fminf(b * rho, most)) / (1 - b);
        }
    }
}

void fs_pane_backward(const Pane *pane, const Camera *camera, const Planes *d_beta, const Planes *d_tau, int y0, int y1,
                      PaneGradient *gradient)
{
    Rays rays = rays_of(camera);
    float n[3], ray[3], f0 = (float)pane->f0, b = (float)pane->dimming, most = (float)FS_PANE_MOST;
    unit_normal(pane, n);
    for (int y = y0; y < y1; y++) {
        const float *d_beta_row = fs_planes_row(d_beta, 0, y), *d_tau_row = fs_planes_row(d_tau, 0, y);
        float part[4] = {0};
        for (int x = 0; x < d_beta->width; x++) {
            float c = cosine(&rays, n, x, y, ray), u = 1 - fabsf(c), u4 = u * u * u * u, rho = 1 + 22 * u4 * u;
            float d_rho =
                (f0 * rho < most ? d_beta_row[x] * f0 : 0) - (b * rho < most ? d_tau_row[x] * b / (1 - b) : 0);
            float d_c = d_rho * 110 * u4 * (c < 0 ? 1.0f : -1.0f);
            for (int k = 0; k < 3; k++) part[k] += d_c * (ray[k] - c * n[k]);
            if (b * rho < most) part[3] += d_tau_row[x] * (1 - rho) / ((1 - b) * (1 - b));
        }
        for (int k = 0; k < 3; k++) gradient->normal[k] += (double)part[k];
        gradient->dimming += (double)part[3];
    }
}

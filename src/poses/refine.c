#include "poses/refine.h"

#include <math.h>
#include <string.h>

#include "base/linalg.h"

double fs_refine_error(const Sight *sight, const double xyz[3])
{
    double pixel[2];
    if (!(fs_camera_project(sight->camera, xyz, pixel) > 0)) return 1e9;
    return hypot(pixel[0] - sight->pixel[0], pixel[1] - sight->pixel[1]);
}

// Adds J^T J and J^T e of one observation; false behind the camera.
static bool add_normal(const Sight *s, const double xyz[3], double jtj[6], double jte[3])
{
    const Camera *c = s->camera;
    const double *m = c->w2c;
    double p[3];
    for (int i = 0; i < 3; i++) p[i] = m[4 * i] * xyz[0] + m[4 * i + 1] * xyz[1] + m[4 * i + 2] * xyz[2] + m[4 * i + 3];
    if (!(p[2] > 0)) return false;
    double u = p[0] / p[2], v = p[1] / p[2];
    double e[2] = {c->fx * u + c->cx - s->pixel[0], c->fy * v + c->cy - s->pixel[1]};
    for (int row = 0; row < 2; row++) {
        double f = (row ? c->fy : c->fx) / p[2], slope = row ? v : u, j[3];
        for (int k = 0; k < 3; k++) j[k] = f * (m[4 * row + k] - slope * m[8 + k]);
        for (int k = 0, at = 0; k < 3; k++) {
            jte[k] += j[k] * e[row];
            for (int l = k; l < 3; l++) jtj[at++] += j[k] * j[l];
        }
    }
    return true;
}

// Solves the symmetric 3x3 system a x = b; a: 00 01 02 11 12 22.
static bool solve(const double a[6], const double b[3], double x[3])
{
    double c0 = a[3] * a[5] - a[4] * a[4], c1 = a[2] * a[4] - a[1] * a[5], c2 = a[1] * a[4] - a[2] * a[3];
    double det = a[0] * c0 + a[1] * c1 + a[2] * c2;
    if (!(det > 1e-12 * a[0] * a[3] * a[5]) || !isfinite(det)) return false;
    double d = a[0] * a[5] - a[2] * a[2], e = a[1] * a[2] - a[0] * a[4], f = a[0] * a[3] - a[1] * a[1];
    x[0] = (c0 * b[0] + c1 * b[1] + c2 * b[2]) / det;
    x[1] = (c1 * b[0] + d * b[1] + e * b[2]) / det;
    x[2] = (c2 * b[0] + e * b[1] + f * b[2]) / det;
    return true;
}

bool fs_refine_point(const Sight *sight, int n, double xyz[3])
{
    double x[3];
    memcpy(x, xyz, sizeof x);
    for (int round = 0; round < 10; round++) {
        double jtj[6] = {0}, jte[3] = {0}, step[3];
        for (int i = 0; i < n; i++)
            if (!add_normal(&sight[i], x, jtj, jte)) return false;
        if (!solve(jtj, jte, step)) return false;
        double moved = 0, size = 0;
        for (int k = 0; k < 3; k++) {
            x[k] -= step[k];
            moved += step[k] * step[k];
            size += x[k] * x[k];
        }
        if (!isfinite(moved)) return false;
        if (moved < 1e-16 * size) break;
    }
    for (int i = 0; i < n; i++)
        if (fs_refine_error(&sight[i], x) >= 1e9) return false;
    memcpy(xyz, x, sizeof x);
    return true;
}

double fs_refine_angle(const Sight *sight, int n, const double xyz[3])
{
    double least = 1; // cosine
    for (int i = 0; i < n; i++) {
        double a[3], b[3];
        fs_camera_centre(sight[i].camera, a);
        for (int j = 0; j < i; j++) {
            double p[3], q[3];
            fs_camera_centre(sight[j].camera, b);
            for (int k = 0; k < 3; k++) p[k] = a[k] - xyz[k], q[k] = b[k] - xyz[k];
            double cosine = v3_dot(p, q) / sqrt(v3_dot(p, p) * v3_dot(q, q));
            if (cosine < least) least = cosine;
        }
    }
    return acos(fmax(least, -1)) * 180 / M_PI;
}

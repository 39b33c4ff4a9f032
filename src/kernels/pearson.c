#include "kernels/pearson.h"

#include <math.h>

#include "kernels/tone_curve.h"

PearsonFit fs_pearson_fit(const PearsonSums *t)
{
    PearsonFit fit = {0};
    if (t->n < 1) return fit;
    fit.mean_x = t->x / t->n;
    fit.mean_y = t->y / t->n;
    double vx = fmax(t->xx / t->n - fit.mean_x * fit.mean_x, 0) + FS_PEARSON_EPSILON;
    double vy = fmax(t->yy / t->n - fit.mean_y * fit.mean_y, 0) + FS_PEARSON_EPSILON;
    double cov = t->xy / t->n - fit.mean_x * fit.mean_y, root = sqrt(vx * vy);
    fit.loss = -cov / root;
    fit.a = -1 / (root * t->n);
    fit.bx = -fit.loss / (vx * t->n);
    fit.by = -fit.loss / (vy * t->n);
    return fit;
}

static PearsonSums sums(const PearsonArgs *args, int y0, int y1)
{
    const Planes *X = args->X_linear, *Y = args->Y_linear;
    PearsonSums s = {0};
    for (int c = 0; c < X->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *px = fs_planes_row(X, c, y), *py = fs_planes_row(Y, c, y);
            for (int x = 0; x < X->width; x++) {
                double a = px[x], b = py[x];
                s.x += a, s.y += b, s.xx += a * a, s.yy += b * b, s.xy += a * b;
            }
        }
    s.n = (double)X->channels * (y1 - y0) * X->width;
    return s;
}

// d_toned += (a (v - mean_v) + b (u - mean_u)) * decode'(toned), of the row u
static void row(float *d_toned, const float *toned, const float *u, const float *v, int n, const PearsonLine *l)
{
    for (int x = 0; x < n; x++)
        d_toned[x] += (l->a * (v[x] - l->mean_v) + l->b * (u[x] - l->mean_u)) * tone_decode_slope(toned[x], u[x]);
}

#include "kernels/pearson_gradient.h"

const PearsonKernels fs_pearson_scalar = {sums, gradient};

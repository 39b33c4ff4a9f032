#include "kernels/photometric.h"

#include <math.h>
#include <stdlib.h>

#include "kernels/photometric_rows.h"

// Weighted sum over the 11 rows of a window at column x, of a and of a * b.
static float blur_rows(const float *const a[TAPS], int x)
{
    float sum = 0;
    for (int i = 0; i < TAPS; i++) sum += window[abs(i - RADIUS)] * a[i][x];
    return sum;
}
static float blur_products(const float *const a[TAPS], const float *const b[TAPS], int x)
{
    float sum = 0;
    for (int i = 0; i < TAPS; i++) sum += window[abs(i - RADIUS)] * a[i][x] * b[i][x];
    return sum;
}
// The same along a row, which has zeros around it.
static float blur_columns(const float *row, int x)
{
    float sum = 0;
    for (int i = -RADIUS; i <= RADIUS; i++) sum += window[abs(i)] * row[x + i];
    return sum;
}

static void target_stats(const PhotometricArgs *args, int y0, int y1)
{
    Rows rows = rows_of(args);
    const float *Y[TAPS];
    for (int c = 0; c < args->Y->channels; c++)
        for (int y = y0; y < y1; y++) {
            float *mu = fs_planes_row(args->mu_Y, c, y), *var = fs_planes_row(args->var_Y, c, y);
            plane_window(&rows, args->Y, c, y, Y);
            for (int x = 0; x < args->Y->width; x++) {
                rows.temp[0][x] = blur_rows(Y, x);
                rows.temp[1][x] = blur_products(Y, Y, x);
            }
            for (int x = 0; x < args->Y->width; x++) {
                mu[x] = blur_columns(rows.temp[0], x);
                var[x] = blur_columns(rows.temp[1], x) - mu[x] * mu[x];
            }
        }
}

static void fill_row(const PhotometricArgs *args, const Rows *rows, int c, int y)
{
    const float *I = fs_planes_row(args->I, c, y), *Y = fs_planes_row(args->Y, c, y);
    const float *m = fs_planes_row(args->mask, 0, y);
    float *out = ring_row(rows, RING_X, y);
    for (int x = 0; x < args->Y->width; x++) out[x] = Y[x] + m[x] * (I[x] - Y[x]);
}

typedef struct Window {
    float mx, my, var_x, var_y, cov;
} Window;
typedef struct Derivatives { // by the window's E[x], E[xx], E[xy]
    float mu, xx, xy;
} Derivatives;

static float add_dssim(Window w, float k, Derivatives *d)
{
    float mx = w.mx, my = w.my, a1 = 2 * mx * my + SSIM_C1, a2 = 2 * w.cov + SSIM_C2;
    float b1 = mx * mx + my * my + SSIM_C1, b2 = w.var_x + w.var_y + SSIM_C2;
    float inverse = 1 / (b1 * b2), ssim = a1 * a2 * inverse;
    float by_xx = -ssim * b1 * inverse, by_xy = 2 * a1 * inverse; // dSSIM / dE[xx], dE[xy]
    float by_mu = 2 * (my * a2 - ssim * mx * b2) * inverse - 2 * mx * by_xx - my * by_xy;
    *d = (Derivatives){d->mu - k * by_mu, d->xx - k * by_xx, d->xy - k * by_xy};
    return 1 - ssim;
}
static float add_contrast(Window w, float k, Derivatives *d)
{
    float q = 1 / (2 * w.var_y + CONTRAST_C), by = 2 * k * q;
    *d = (Derivatives){d->mu - by * (w.mx - w.my), d->xx + k * q, d->xy - by};
    return q * (w.var_x + w.var_y - 2 * w.cov);
}

static PhotometricSums derive_row(const PhotometricArgs *args, const Rows *rows, int c, int y)
{
    const float *X[TAPS], *Y[TAPS];
    int width = args->Y->width;
    if (args->mask)
        ring_window(rows, RING_X, y, X);
    else
        plane_window(rows, args->I, c, y, X);
    plane_window(rows, args->Y, c, y, Y);
    for (int x = 0; x < width; x++) {
        rows->temp[0][x] = blur_rows(X, x);
        rows->temp[1][x] = blur_products(X, X, x);
        rows->temp[2][x] = blur_products(X, Y, x);
    }
    const float *mu_Y = fs_planes_row(args->mu_Y, c, y), *var_Y = fs_planes_row(args->var_Y, c, y);
    const float *mask = args->mask ? fs_planes_row(args->mask, 0, y) : NULL;
    float *d_mu = ring_row(rows, RING_D_MU, y), *d_xx = ring_row(rows, RING_D_XX, y);
    float *d_xy = ring_row(rows, RING_D_XY, y);
    float k = value_weight(args, args->lambda), kv = value_weight(args, args->kappa);
    PhotometricSums sums = {0, 0, 0};
    for (int x = 0; x < width; x++) {
        Window w = {.mx = blur_columns(rows->temp[0], x), .my = mu_Y[x], .var_y = var_Y[x]};
        w.var_x = blur_columns(rows->temp[1], x) - w.mx * w.mx;
        w.cov = blur_columns(rows->temp[2], x) - w.mx * w.my;
        float m = mask ? mask[x] : 1;
        Derivatives d = {0, 0, 0};
        if (args->lambda > 0) sums.dssim += m * add_dssim(w, k * m, &d);
        if (args->kappa > 0) sums.contrast += m * add_contrast(w, kv * m, &d);
        d_mu[x] = d.mu;
        d_xx[x] = d.xx;
        d_xy[x] = d.xy;
    }
    return sums;
}

static double gradient_row(const PhotometricArgs *args, const Rows *rows, int c, int y)
{
    const float *window_of[3][TAPS];
    int width = args->Y->width;
    const float *I = fs_planes_row(args->I, c, y), *Y = fs_planes_row(args->Y, c, y);
    const float *mask = args->mask ? fs_planes_row(args->mask, 0, y) : NULL;
    const float *X = mask && has_windows(args) ? ring_row(rows, RING_X, y) : I;
    double sum = 0;
    for (int x = 0; x < width; x++) sum += (mask ? mask[x] : 1) * fabsf(I[x] - Y[x]);
    if (!args->d_I) return sum;
    for (int i = 0; i < 3; i++) {
        if (!has_windows(args)) break;
        ring_window(rows, RING_D_MU + i, y, window_of[i]);
        for (int x = 0; x < width; x++) rows->temp[i][x] = blur_rows(window_of[i], x);
    }
    float *d_I = fs_planes_row(args->d_I, c, y), k = value_weight(args, 1 - args->lambda - args->kappa);
    for (int x = 0; x < width; x++) {
        float d = I[x] - Y[x], sign = (float)((d > 0) - (d < 0));
        float windows = blur_columns(rows->temp[0], x) + 2 * X[x] * blur_columns(rows->temp[1], x) +
                        Y[x] * blur_columns(rows->temp[2], x);
        d_I[x] = (mask ? mask[x] : 1) * (windows + k * sign);
    }
    return sum;
}

static PhotometricSums loss(const PhotometricArgs *args, int y0, int y1)
{
    static const RowFunctions functions = {fill_row, derive_row, gradient_row};
    return loss_of_rows(args, &functions, y0, y1);
}

const PhotometricKernels fs_photometric_scalar = {target_stats, loss};

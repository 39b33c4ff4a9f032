// Written once for AVX2, AVX-512 and NEON; see simd.h. Each blur is a vertical pass over 11 rows into a scratch row,
// then a horizontal one over the scratch row, which stays in the first cache.
#include "kernels/photometric.h"
#include "kernels/photometric_rows.h"
#include "kernels/simd.h"

INLINE vf blur_rows(const float *const a[TAPS], int x)
{
    vf sum = v_set(window[0]) * v_load(a[RADIUS] + x);
    for (int i = 1; i <= RADIUS; i++)
        sum = v_fma(v_set(window[i]), v_load(a[RADIUS - i] + x) + v_load(a[RADIUS + i] + x), sum);
    return sum;
}
INLINE vf blur_columns(const float *row, int x)
{
    vf sum = v_set(window[0]) * v_load(row + x);
    for (int i = 1; i <= RADIUS; i++) sum = v_fma(v_set(window[i]), v_load(row + x - i) + v_load(row + x + i), sum);
    return sum;
}
// Vertical sums of x, x^2 and (where Y is given) x y.
INLINE void blur_moments(const Rows *rows, const float *const X[TAPS], const float *const Y[TAPS], int width)
{
    for (int x = 0; x < width; x += VW) {
        vf sum = v_set(0), xx = sum, xy = sum;
        for (int i = 0; i < TAPS; i++) {
            vf a = v_load(X[i] + x), w = v_set(window[i < RADIUS ? RADIUS - i : i - RADIUS]) * a;
            sum += w;
            xx = v_fma(w, a, xx);
            if (Y) xy = v_fma(w, v_load(Y[i] + x), xy);
        }
        v_store(rows->temp[0] + x, sum);
        v_store(rows->temp[1] + x, xx);
        if (Y) v_store(rows->temp[2] + x, xy);
    }
}
// The vertical passes write whole vectors: clear what lies beyond the width.
INLINE void clear_ends(const Rows *rows, int width)
{
    for (int i = 0; i < 3; i++)
        memset(rows->temp[i] + width, 0, (rows->pitch - FS_PHOTOMETRIC_PAD - (size_t)width) * sizeof(float));
}

static void target_stats(const PhotometricArgs *args, int y0, int y1)
{
    Rows rows = rows_of(args);
    const float *Y[TAPS];
    int width = args->Y->width;
    for (int c = 0; c < args->Y->channels; c++)
        for (int y = y0; y < y1; y++) {
            float *mu = fs_planes_row(args->mu_Y, c, y), *var = fs_planes_row(args->var_Y, c, y);
            plane_window(&rows, args->Y, c, y, Y);
            blur_moments(&rows, Y, NULL, width);
            clear_ends(&rows, width);
            for (int x = 0; x < width; x += VW) {
                vf m = blur_columns(rows.temp[0], x);
                v_store(mu + x, m);
                v_store(var + x, blur_columns(rows.temp[1], x) - m * m);
            }
        }
}

static void fill_row(const PhotometricArgs *args, const Rows *rows, int c, int y)
{
    const float *I = fs_planes_row(args->I, c, y), *Y = fs_planes_row(args->Y, c, y);
    const float *mask = fs_planes_row(args->mask, 0, y);
    float *out = ring_row(rows, RING_X, y);
    for (int x = 0; x < args->Y->width; x += VW) {
        vf target = v_load(Y + x);
        v_store(out + x, v_fma(v_load(mask + x), v_load(I + x) - target, target));
    }
}

typedef struct Window {
    vf mx, my, var_x, var_y, cov;
} Window;
typedef struct Derivatives { // by the window's E[x], E[xx], E[xy]
    vf mu, xx, xy;
} Derivatives;

INLINE vf add_dssim(const Window *w, vf k, Derivatives *d)
{
    vf one = v_set(1), two = v_set(2), c1 = v_set(SSIM_C1), c2 = v_set(SSIM_C2), mx = w->mx, my = w->my;
    vf a1 = v_fma(two * mx, my, c1), a2 = v_fma(two, w->cov, c2);
    vf b1 = v_fma(mx, mx, v_fma(my, my, c1)), b2 = w->var_x + w->var_y + c2;
    vf inverse = one / (b1 * b2), ssim = a1 * a2 * inverse;
    vf half_xx = ssim * b1 * inverse, half_xy = a1 * inverse; // -dSSIM / dE[xx], half of dSSIM / dE[xy]
    // half of dSSIM / dmu
    vf half_mu = (my * a2 - ssim * mx * b2) * inverse + mx * half_xx - my * half_xy;
    *d = (Derivatives){d->mu - two * k * half_mu, v_fma(k, half_xx, d->xx), d->xy - two * k * half_xy};
    return one - ssim;
}
INLINE vf add_contrast(const Window *w, vf k, Derivatives *d)
{
    vf two = v_set(2), q = v_set(1) / v_fma(two, w->var_y, v_set(CONTRAST_C)), by = two * k * q;
    *d = (Derivatives){d->mu - by * (w->mx - w->my), v_fma(k, q, d->xx), d->xy - by};
    return q * (w->var_x + w->var_y - two * w->cov);
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
    blur_moments(rows, X, Y, width);
    clear_ends(rows, width);
    const float *mu_Y = fs_planes_row(args->mu_Y, c, y), *var_Y = fs_planes_row(args->var_Y, c, y);
    const float *mask = args->mask ? fs_planes_row(args->mask, 0, y) : NULL;
    float *d_mu = ring_row(rows, RING_D_MU, y), *d_xx = ring_row(rows, RING_D_XX, y);
    float *d_xy = ring_row(rows, RING_D_XY, y);
    vf k = v_set(value_weight(args, args->lambda)), kv = v_set(value_weight(args, args->kappa));
    vf dssim = v_set(0), contrast = dssim;
    for (int x = 0; x < width; x += VW) {
        Window w = {.mx = blur_columns(rows->temp[0], x), .my = v_load(mu_Y + x), .var_y = v_load(var_Y + x)};
        w.var_x = blur_columns(rows->temp[1], x) - w.mx * w.mx;
        w.cov = blur_columns(rows->temp[2], x) - w.mx * w.my;
        vf m = mask ? v_load(mask + x) : v_set(1);
        vm lanes = vm_first(width - x);
        Derivatives d = {v_set(0), v_set(0), v_set(0)};
        if (args->lambda > 0) dssim += v_where(lanes, m * add_dssim(&w, k * m, &d));
        if (args->kappa > 0) contrast += v_where(lanes, m * add_contrast(&w, kv * m, &d));
        v_store(d_mu + x, d.mu);
        v_store(d_xx + x, d.xx);
        v_store(d_xy + x, d.xy);
    }
    return (PhotometricSums){0, v_sum(dssim), v_sum(contrast)};
}

static double gradient_row(const PhotometricArgs *args, const Rows *rows, int c, int y)
{
    const float *d_mu[TAPS], *d_xx[TAPS], *d_xy[TAPS];
    int width = args->Y->width;
    const float *I = fs_planes_row(args->I, c, y), *Y = fs_planes_row(args->Y, c, y);
    const float *mask = args->mask ? fs_planes_row(args->mask, 0, y) : NULL;
    const float *X = mask && has_windows(args) ? ring_row(rows, RING_X, y) : I;
    float *d_I = args->d_I ? fs_planes_row(args->d_I, c, y) : NULL;
    if (d_I && has_windows(args)) {
        ring_window(rows, RING_D_MU, y, d_mu);
        ring_window(rows, RING_D_XX, y, d_xx);
        ring_window(rows, RING_D_XY, y, d_xy);
        for (int x = 0; x < width; x += VW) {
            v_store(rows->temp[0] + x, blur_rows(d_mu, x));
            v_store(rows->temp[1] + x, blur_rows(d_xx, x));
            v_store(rows->temp[2] + x, blur_rows(d_xy, x));
        }
        clear_ends(rows, width);
    }
    vf k = v_set(value_weight(args, 1 - args->lambda - args->kappa)), sum = v_set(0), zero = v_set(0), one = v_set(1);
    for (int x = 0; x < width; x += VW) {
        vm lanes = vm_first(width - x);
        vf target = v_load(Y + x), d = v_load(I + x) - target, m = mask ? v_load(mask + x) : one;
        sum += v_where(lanes, m * v_abs(d));
        if (!d_I) continue;
        vf windows = v_fma(target, blur_columns(rows->temp[2], x), blur_columns(rows->temp[0], x));
        windows = v_fma(v_load(X + x) + v_load(X + x), blur_columns(rows->temp[1], x), windows);
        vf l1 = v_where(v_lt(zero, v_abs(d)), v_copysign(k, d));
        v_store(d_I + x, v_where(lanes, m * (windows + l1)));
    }
    return v_sum(sum);
}

static PhotometricSums loss(const PhotometricArgs *args, int y0, int y1)
{
    static const RowFunctions functions = {fill_row, derive_row, gradient_row};
    return loss_of_rows(args, &functions, y0, y1);
}

const PhotometricKernels FS_SIMD_SUFFIX(fs_photometric) = {target_stats, loss};

// What the scalar definition and the SIMD twins of photometric share: the window and the rows of the scratch buffer.
#ifndef FS_KERNELS_PHOTOMETRIC_ROWS_H
#define FS_KERNELS_PHOTOMETRIC_ROWS_H

#include <stdbool.h>
#include <string.h>

#include "kernels/photometric.h"

enum { RADIUS = FS_PHOTOMETRIC_RADIUS, TAPS = 2 * RADIUS + 1 };

// Gaussian of sigma 1.5 at distance 0..5, normalised over 11 taps.
static const float window[RADIUS + 1] = {0.266011725f,  0.21300554f,    0.10936069f,
                                         0.0360007721f, 0.00759875814f, 0.00102838008f};

#define SSIM_C1 1e-4f
#define SSIM_C2 9e-4f
#define CONTRAST_C 1e-4f

// Rings of rows, row y in slot y mod RING; every row has PAD zeros to its left and right.
enum { RING_X, RING_D_MU, RING_D_XX, RING_D_XY, RINGS };

typedef struct Rows {
    float *temp[3]; // vertically blurred rows
    float *zero;    // stands for rows outside the image
    float *ring[RINGS];
    size_t pitch;
    int height;
} Rows;

static inline Rows rows_of(const PhotometricArgs *args)
{
    Rows r = {.pitch = fs_photometric_pitch(args->Y->width), .height = args->Y->height};
    float *p = (float *)args->scratch + FS_PHOTOMETRIC_PAD;
    memset(args->scratch, 0, 4 * r.pitch * sizeof(float));
    for (int i = 0; i < 3; i++, p += r.pitch) r.temp[i] = p;
    r.zero = p, p += r.pitch;
    for (int i = 0; i < RINGS; i++, p += r.pitch * FS_PHOTOMETRIC_RING) r.ring[i] = p;
    return r;
}

static inline float *ring_row(const Rows *r, int ring, int y)
{
    return r->ring[ring] + (size_t)(y % FS_PHOTOMETRIC_RING) * r->pitch;
}

// Rows y - 5 .. y + 5 of a ring or of a plane.
static inline void ring_window(const Rows *r, int ring, int y, const float *out[TAPS])
{
    for (int i = 0; i < TAPS; i++) {
        int yi = y + i - RADIUS;
        out[i] = yi >= 0 && yi < r->height ? ring_row(r, ring, yi) : r->zero;
    }
}
static inline void plane_window(const Rows *r, const Planes *p, int c, int y, const float *out[TAPS])
{
    for (int i = 0; i < TAPS; i++) {
        int yi = y + i - RADIUS;
        out[i] = yi >= 0 && yi < r->height ? fs_planes_row(p, c, yi) : r->zero;
    }
}

// Gradients of the strip's rows, in the order that keeps the rings small. The twins supply the row functions:
//   fill_row     RING_X row y = m I + (1 - m) Y                              (only with a mask)
//   derive_row   row y of the derivatives by the windows' moments into RING_D_*; returns the row's sums of m (1 - SSIM)
//                and m V
//   gradient_row row y of d_I from the rings; returns the row's sum of m |I - Y|
typedef struct RowFunctions {
    void (*fill_row)(const PhotometricArgs *args, const Rows *rows, int c, int y);
    PhotometricSums (*derive_row)(const PhotometricArgs *args, const Rows *rows, int c, int y);
    double (*gradient_row)(const PhotometricArgs *args, const Rows *rows, int c, int y);
} RowFunctions;

static inline bool has_windows(const PhotometricArgs *args)
{
    return args->lambda > 0 || args->kappa > 0;
}

static inline PhotometricSums loss_of_rows(const PhotometricArgs *args, const RowFunctions *f, int y0, int y1)
{
    Rows rows = rows_of(args);
    int height = rows.height, reach = args->d_I ? RADIUS : 0;
    double n = (double)args->Y->channels * height * args->Y->width;
    PhotometricSums sums = {0, 0, 0};
    for (int c = 0; c < args->Y->channels; c++) {
        int derived = y0 - reach < 0 ? 0 : y0 - reach;
        int filled = derived - RADIUS < 0 ? 0 : derived - RADIUS;
        for (int y = y0; y < y1; y++) {
            for (; has_windows(args) && derived <= y + reach && derived < height; derived++) {
                if (args->mask)
                    for (; filled <= derived + RADIUS && filled < height; filled++) f->fill_row(args, &rows, c, filled);
                PhotometricSums row = f->derive_row(args, &rows, c, derived);
                if (derived < y0 || derived >= y1) continue;
                sums.dssim += row.dssim;
                sums.contrast += row.contrast;
            }
            sums.l1 += f->gradient_row(args, &rows, c, y);
        }
    }
    sums.l1 /= n;
    sums.dssim /= n;
    sums.contrast /= n;
    return sums;
}

// weight * share / number of values: what one value's gradient is multiplied with.
static inline float value_weight(const PhotometricArgs *args, float share)
{
    return args->weight * share / ((float)args->Y->channels * (float)args->Y->height * (float)args->Y->width);
}

#endif

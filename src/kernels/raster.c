// Scalar definition of the rasteriser. REAL can be double, for gradient checks.
#include "kernels/raster.h"

#include <math.h>
#include <string.h>

#ifndef REAL
#define REAL float
#endif

static void cover(const Splat *s, int x0, int y0, int tiles, float t_min, uint32_t *mask)
{
    const float margin = 1e-3f;
    memset(mask, 0, sizeof *mask * (size_t)tiles);
    for (int row = 0; row < FS_TILE_H; row++) {
        float dy = (float)(y0 + row) + 0.5f - s->y;
        float disc = s->b * s->b * dy * dy - 4 * s->a * (s->c * dy * dy + s->l - t_min);
        if (!(disc >= 0)) continue;
        float half = sqrtf(disc) / (-2 * s->a), mid = s->x - s->b * dy / (2 * s->a) - (float)x0;
        float lo = mid - half - margin, hi = mid + half + margin;
        for (int i = 0; i < tiles; i++) {
            float x = (float)(i * FS_TILE_W);
            if (lo <= x + FS_TILE_W - 0.5f && hi >= x + 0.5f) mask[i] |= 1u << row;
        }
    }
}

// log2 of alpha at a pixel; its offset from the mean in d.
static REAL exponent(const RasterTile *tile, const Splat *s, int pixel, REAL d[2])
{
    d[0] = (REAL)(tile->x0 + pixel % FS_TILE_W) + (REAL)0.5 - (REAL)s->x;
    d[1] = (REAL)(tile->y0 + pixel / FS_TILE_W) + (REAL)0.5 - (REAL)s->y;
    return ((REAL)s->a * d[0] + (REAL)s->b * d[1]) * d[0] + (REAL)s->c * d[1] * d[1] + (REAL)s->l;
}

static long forward(const RasterTile *tile, float *feature, float *transmittance)
{
    long pairs = 0;
    for (int p = 0; p < FS_TILE_PIXELS; p++) {
        REAL T = 1, sum[FS_FEATURES_MAX] = {0};
        for (int i = 0; i < tile->n && T >= (REAL)tile->transmittance_min; i++) {
            const Splat *s = &tile->splats[tile->entry[i].splat];
            REAL d[2], t = exponent(tile, s, p, d);
            if (!(tile->entry[i].mask >> (p / FS_TILE_W) & 1) || t < (REAL)tile->t_min) continue;
            REAL alpha = (REAL)exp2((double)t);
            if (alpha > (REAL)FS_ALPHA_MAX) alpha = (REAL)FS_ALPHA_MAX;
            REAL w = alpha * T, last = tile->median ? T >= (REAL)0.5 && T - w < (REAL)0.5 : w;
            for (int c = 0; c < tile->features; c++)
                sum[c] += (c == tile->features - 1 ? last : w) * (REAL)s->feature[c];
            T -= w;
            pairs++;
        }
        for (int c = 0; c < tile->features; c++) feature[c * FS_TILE_PIXELS + p] = (float)sum[c];
        transmittance[p] = (float)T;
    }
    return pairs;
}

static void backward(const RasterTile *tile, const float *feature, const float *transmittance, const float *d_feature,
                     const float *d_transmittance, float *records)
{
    REAL T[FS_TILE_PIXELS], behind[FS_TILE_PIXELS]; // S_i + d_T T_end
    for (int p = 0; p < FS_TILE_PIXELS; p++) {
        T[p] = 1;
        behind[p] = d_transmittance ? (REAL)d_transmittance[p] * (REAL)transmittance[p] : 0;
        for (int c = 0; c < tile->features; c++)
            behind[p] += (REAL)d_feature[c * FS_TILE_PIXELS + p] * (REAL)feature[c * FS_TILE_PIXELS + p];
    }
    for (int i = 0; i < tile->n; i++) {
        const Splat *s = &tile->splats[tile->entry[i].splat];
        REAL r[FS_RECORD] = {0};
        for (int p = 0; p < FS_TILE_PIXELS; p++) {
            REAL d[2], t = exponent(tile, s, p, d);
            if (!(tile->entry[i].mask >> (p / FS_TILE_W) & 1) || t < (REAL)tile->t_min) continue;
            if (!(T[p] >= (REAL)tile->transmittance_min)) continue;
            REAL alpha = (REAL)exp2((double)t), g = 0;
            int clamped = alpha > (REAL)FS_ALPHA_MAX;
            if (clamped) alpha = (REAL)FS_ALPHA_MAX;
            REAL w = alpha * T[p];
            for (int c = 0; c < tile->features; c++) {
                REAL d_c = (REAL)d_feature[c * FS_TILE_PIXELS + p];
                g += d_c * (REAL)s->feature[c];
                r[6 + c] += w * d_c;
            }
            behind[p] -= w * g;
            REAL d_t = clamped ? 0 : (REAL)0.693147180559945 * alpha * (T[p] * g - behind[p] / (1 - alpha));
            T[p] -= w;
            r[0] += d_t;
            r[1] += d_t * d[0];
            r[2] += d_t * d[1];
            r[3] += d_t * d[0] * d[0];
            r[4] += d_t * d[0] * d[1];
            r[5] += d_t * d[1] * d[1];
        }
        for (int k = 0; k < FS_RECORD; k++) records[(size_t)tile->entry[i].slot * FS_RECORD + (size_t)k] = (float)r[k];
    }
}

const RasterKernels fs_raster_scalar = {cover, forward, backward};

// Bilinear interpolation between the four pixels around a place. Positions are of pixels' middles: x = 0 is the first.
#pragma once

#include <stddef.h>

typedef struct Bilinear {
    size_t at[4]; // pixels: upper left and right, lower left and right; those beyond the last are the last
    float fx, fy;
} Bilinear;

static inline Bilinear fs_bilinear_at(double x, double y, int width, int height) // x, y >= 0, in the image
{
    int x0 = (int)x, y0 = (int)y, x1 = x0 + 1 < width ? x0 + 1 : x0, y1 = y0 + 1 < height ? y0 + 1 : y0;
    size_t upper = (size_t)y0 * (size_t)width, lower = (size_t)y1 * (size_t)width;
    return (Bilinear){{upper + (size_t)x0, upper + (size_t)x1, lower + (size_t)x0, lower + (size_t)x1},
                      (float)(x - x0),
                      (float)(y - y0)};
}

static inline float fs_bilinear_value(const Bilinear *b, const float *px, int channels, int c)
{
    size_t n = (size_t)channels, k = (size_t)c;
    float top = px[b->at[0] * n + k] * (1 - b->fx) + px[b->at[1] * n + k] * b->fx;
    float bottom = px[b->at[2] * n + k] * (1 - b->fx) + px[b->at[3] * n + k] * b->fx;
    return top * (1 - b->fy) + bottom * b->fy;
}

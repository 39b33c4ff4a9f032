#include "image/blur.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

// Along a row (step: channels) or a column (step: a row's values).
static void blur_line(const float *in, float *out, int n, size_t step, float sigma)
{
    int radius = (int)(3 * sigma + 0.5f);
    float weight[16], sum = 0;
    assert(radius < 16);
    for (int k = 0; k <= radius; k++) sum += (k ? 2 : 1) * (weight[k] = expf(-0.5f * (float)(k * k) / (sigma * sigma)));
    for (int i = 0; i < n; i++) {
        float v = 0;
        for (int k = -radius; k <= radius; k++) {
            int at = i + k < 0 ? -(i + k) : i + k >= n ? 2 * n - 2 - i - k : i + k;
            if (at < 0 || at >= n) at = at < 0 ? 0 : n - 1; // an image smaller than the Gaussian
            v += weight[abs(k)] * in[(size_t)at * step];
        }
        out[(size_t)i * step] = v / sum;
    }
}

void fs_blur_image(const Image *image, float *scratch, float *out, float sigma)
{
    size_t channels = (size_t)image->channels, row = (size_t)image->width * channels;
    for (size_t y = 0; y < (size_t)image->height; y++)
        for (size_t c = 0; c < channels; c++)
            blur_line(image->px + y * row + c, scratch + y * row + c, image->width, channels, sigma);
    for (size_t x = 0; x < row; x++) blur_line(scratch + x, out + x, image->height, row, sigma);
}

// Textures as sRGB bytes (a quarter of the memory of floats, so that they stay in the caches) with box-filtered levels.
#include "synth/texture.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "image/tone.h"

static float linear_of[256];

// Rounded by way of nine digits, as all captures made so far were.
static void fill_linear(void)
{
    for (int i = 0; i < 256; i++) {
        double coded = i / 255.0;
        char digits[24];
        snprintf(digits, sizeof digits, "%.9g", coded <= 0.04045 ? coded / 12.92 : pow((coded + 0.055) / 1.055, 2.4));
        linear_of[i] = strtof(digits, NULL);
    }
}

const float *fs_texture_linear(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, fill_linear);
    return linear_of;
}

static uint8_t to_byte(float coded)
{
    return (uint8_t)(coded <= 0.0f ? 0.0f : coded >= 1.0f ? 255.0f : coded * 255.0f + 0.5f);
}

static int new_level(Texture *t, int level, int width, int height)
{
    t->width[level] = width;
    t->height[level] = height;
    t->texel[level] = malloc((size_t)width * (size_t)height * 4);
    if (!t->texel[level]) return -1;
    t->levels = level + 1;
    return 0;
}

static void halve(Texture *t, int level)
{
    int w = t->width[level], h = t->height[level], w0 = t->width[level - 1], h0 = t->height[level - 1];
    const uint8_t *from = t->texel[level - 1];
    const float *linear = fs_texture_linear();
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++)
            for (int c = 0; c < 4; c++) {
                int x1 = 2 * x + 1 < w0 ? 2 * x + 1 : w0 - 1, y1 = 2 * y + 1 < h0 ? 2 * y + 1 : h0 - 1;
                const int at[4] = {2 * y * w0 + 2 * x, 2 * y * w0 + x1, y1 * w0 + 2 * x, y1 * w0 + x1};
                float sum = 0.0f;
                for (int i = 0; i < 4; i++) sum += linear[from[at[i] * 4 + c]];
                t->texel[level][(y * w + x) * 4 + c] = to_byte(fs_tone_srgb_encode(0.25f * sum));
            }
}

int fs_texture_new(Texture *texture, const Canvas *canvas)
{
    *texture = (Texture){0};
    if (new_level(texture, 0, canvas->width, canvas->height) < 0) return -1;
    size_t n = (size_t)canvas->width * (size_t)canvas->height;
    double sum[3] = {0};
    const float *linear = fs_texture_linear();
    for (size_t i = 0; i < n; i++) {
        for (int c = 0; c < 3; c++) {
            uint8_t byte = to_byte(canvas->px[3 * i + c]);
            texture->texel[0][4 * i + c] = byte;
            sum[c] += linear[byte];
        }
        texture->texel[0][4 * i + 3] = 0;
    }
    texture->mean = vec((float)(sum[0] / (double)n), (float)(sum[1] / (double)n), (float)(sum[2] / (double)n));
    for (int l = 1; l < TEXTURE_LEVELS; l++) {
        int w = texture->width[l - 1], h = texture->height[l - 1];
        if (w == 1 && h == 1) break;
        if (new_level(texture, l, w > 1 ? w / 2 : 1, h > 1 ? h / 2 : 1) < 0) return -1;
        halve(texture, l);
    }
    return 0;
}

void fs_texture_free(Texture *texture)
{
    for (int l = 0; l < TEXTURE_LEVELS; l++) free(texture->texel[l]);
    *texture = (Texture){0};
}

static Vec bilinear(const Texture *t, int level, float u, float v)
{
    int w = t->width[level], h = t->height[level];
    float x = u * (float)w - 0.5f, y = v * (float)h - 0.5f, fx = floorf(x), fy = floorf(y), a = x - fx, b = y - fy;
    int x0 = (int)fx, y0 = (int)fy;
    x0 = x0 < 0 ? x0 + w : x0;
    y0 = y0 < 0 ? y0 + h : y0;
    int x1 = x0 + 1 >= w ? 0 : x0 + 1, y1 = y0 + 1 >= h ? 0 : y0 + 1;
    const uint8_t *row0 = t->texel[level] + (size_t)y0 * (size_t)w * 4,
                  *row1 = t->texel[level] + (size_t)y1 * (size_t)w * 4;
    const uint8_t *p = row0 + 4 * x0, *q = row0 + 4 * x1, *r = row1 + 4 * x0, *s = row1 + 4 * x1;
    float wp = (1 - a) * (1 - b), wq = a * (1 - b), wr = (1 - a) * b, ws = a * b;
    const float *lut = fs_texture_linear();
    return vec(wp * lut[p[0]] + wq * lut[q[0]] + wr * lut[r[0]] + ws * lut[s[0]],
               wp * lut[p[1]] + wq * lut[q[1]] + wr * lut[r[1]] + ws * lut[s[1]],
               wp * lut[p[2]] + wq * lut[q[2]] + wr * lut[r[2]] + ws * lut[s[2]]);
}

Vec fs_texture_sample(const Texture *texture, float u, float v, float spread)
{
    u -= floorf(u);
    v = 1.0f - (v - floorf(v));
    if (u >= 1.0f) u = 0.0f;
    if (v >= 1.0f) v = 0.0f;
    float level = spread > 1.0f ? log2f(spread) : 0.0f;
    int last = texture->levels - 1, l = (int)level;
    if (l >= last) return bilinear(texture, last, u, v);
    Vec fine = bilinear(texture, l, u, v);
    float t = level - (float)l;
    if (t < 0.02f) return fine;
    Vec coarse = bilinear(texture, l + 1, u, v);
    return vec_mad(fine, vec_sub(coarse, fine), t);
}

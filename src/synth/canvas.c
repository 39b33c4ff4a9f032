// Painting: every shape is a coverage (0..1) per pixel, blended over what is there.
#include "synth/canvas.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "synth/letters.h"

int fs_canvas_new(Canvas *canvas, float w_cm, float h_cm, float px_per_cm)
{
    int w = (int)(w_cm * px_per_cm + 0.5f), h = (int)(h_cm * px_per_cm + 0.5f);
    w = w < 4 ? 4 : w > 2048 ? 2048 : w;
    h = h < 4 ? 4 : h > 2048 ? 2048 : h;
    float scale = fminf((float)w / w_cm, (float)h / h_cm);
    *canvas = (Canvas){(int)fmaxf(4, w_cm * scale), (int)fmaxf(4, h_cm * scale), w_cm, h_cm, scale, NULL};
    canvas->px = calloc((size_t)canvas->width * (size_t)canvas->height, 3 * sizeof(float));
    return canvas->px ? 0 : -1;
}

void fs_canvas_free(Canvas *canvas)
{
    free(canvas->px);
    *canvas = (Canvas){0};
}

static float clamp01(float x)
{
    return x < 0.0f ? 0.0f : x > 1.0f ? 1.0f : x;
}

static void blend(Canvas *c, int x, int y, Color color, float cover)
{
    float *p = c->px + ((size_t)y * (size_t)c->width + (size_t)x) * 3;
    p[0] += (color.x - p[0]) * cover;
    p[1] += (color.y - p[1]) * cover;
    p[2] += (color.z - p[2]) * cover;
}

typedef struct Box {
    int x0, y0, x1, y1;
} Box;

// Pixels touched by a rectangle given in pixels, with a margin of one.
static Box touched(const Canvas *c, float x0, float y0, float x1, float y1)
{
    Box b = {(int)floorf(x0) - 1, (int)floorf(y0) - 1, (int)ceilf(x1) + 1, (int)ceilf(y1) + 1};
    b.x0 = b.x0 < 0 ? 0 : b.x0;
    b.y0 = b.y0 < 0 ? 0 : b.y0;
    b.x1 = b.x1 > c->width ? c->width : b.x1;
    b.y1 = b.y1 > c->height ? c->height : b.y1;
    return b;
}

void fs_canvas_fill(Canvas *canvas, Color color)
{
    for (size_t i = 0, n = (size_t)canvas->width * (size_t)canvas->height; i < n; i++)
        memcpy(canvas->px + 3 * i, &color, sizeof color);
}

void fs_canvas_gradient(Canvas *canvas, float x, float y, float w, float h, Color top, Color bottom)
{
    float s = canvas->scale, x0 = x * s, x1 = (x + w) * s, y0 = y * s, y1 = (y + h) * s;
    Box b = touched(canvas, x0, y0, x1, y1);
    for (int j = b.y0; j < b.y1; j++) {
        float cy = clamp01(fminf((float)j + 1, y1) - fmaxf((float)j, y0));
        Color color = fs_canvas_mix(top, bottom, clamp01(((float)j + 0.5f - y0) / fmaxf(y1 - y0, 1e-3f)));
        for (int i = b.x0; i < b.x1; i++) {
            float cx = clamp01(fminf((float)i + 1, x1) - fmaxf((float)i, x0));
            if (cx * cy > 0.0f) blend(canvas, i, j, color, cx * cy);
        }
    }
}

void fs_canvas_rect(Canvas *canvas, float x, float y, float w, float h, Color color)
{
    fs_canvas_gradient(canvas, x, y, w, h, color, color);
}

void fs_canvas_border(Canvas *canvas, float x, float y, float w, float h, float thick, Color color)
{
    fs_canvas_rect(canvas, x, y, w, thick, color);
    fs_canvas_rect(canvas, x, y + h - thick, w, thick, color);
    fs_canvas_rect(canvas, x, y + thick, thick, h - 2 * thick, color);
    fs_canvas_rect(canvas, x + w - thick, y + thick, thick, h - 2 * thick, color);
}

void fs_canvas_ring(Canvas *canvas, float x, float y, float radius, float thick, Color color)
{
    float s = canvas->scale, cx = x * s, cy = y * s, r = radius * s, half = 0.5f * thick * s;
    Box b = touched(canvas, cx - r - half, cy - r - half, cx + r + half, cy + r + half);
    for (int j = b.y0; j < b.y1; j++)
        for (int i = b.x0; i < b.x1; i++) {
            float dx = (float)i + 0.5f - cx, dy = (float)j + 0.5f - cy;
            float cover = clamp01(half - fabsf(sqrtf(dx * dx + dy * dy) - r) + 0.5f);
            if (cover > 0.0f) blend(canvas, i, j, color, cover);
        }
}

void fs_canvas_disc(Canvas *canvas, float x, float y, float radius, Color color)
{
    fs_canvas_ring(canvas, x, y, 0.5f * radius, radius, color);
}

void fs_canvas_line(Canvas *canvas, float x0, float y0, float x1, float y1, float thick, Color color)
{
    float s = canvas->scale, ax = x0 * s, ay = y0 * s, bx = x1 * s - ax, by = y1 * s - ay, half = 0.5f * thick * s;
    float length2 = fmaxf(bx * bx + by * by, 1e-6f);
    Box b = touched(canvas, fminf(ax, ax + bx) - half, fminf(ay, ay + by) - half, fmaxf(ax, ax + bx) + half,
                    fmaxf(ay, ay + by) + half);
    float peak = clamp01(2.0f * half); // lines thinner than a pixel fade
    for (int j = b.y0; j < b.y1; j++)
        for (int i = b.x0; i < b.x1; i++) {
            float px = (float)i + 0.5f - ax, py = (float)j + 0.5f - ay, t = clamp01((px * bx + py * by) / length2);
            float dx = px - t * bx, dy = py - t * by;
            float cover = clamp01(fmaxf(half, 0.5f) - sqrtf(dx * dx + dy * dy) + 0.5f) * peak;
            if (cover > 0.0f) blend(canvas, i, j, color, cover);
        }
}

void fs_canvas_triangle(Canvas *canvas, const float xy[6], Color color)
{
    float p[6], s = canvas->scale;
    for (int i = 0; i < 6; i++) p[i] = xy[i] * s;
    float area = (p[2] - p[0]) * (p[5] - p[1]) - (p[4] - p[0]) * (p[3] - p[1]), sign = area < 0 ? -1.0f : 1.0f;
    Box b = touched(canvas, fminf(fminf(p[0], p[2]), p[4]), fminf(fminf(p[1], p[3]), p[5]),
                    fmaxf(fmaxf(p[0], p[2]), p[4]), fmaxf(fmaxf(p[1], p[3]), p[5]));
    for (int j = b.y0; j < b.y1; j++)
        for (int i = b.x0; i < b.x1; i++) {
            float cover = 1.0f, x = (float)i + 0.5f, y = (float)j + 0.5f;
            for (int e = 0; e < 3; e++) {
                const float *a = p + 2 * e, *c = p + 2 * ((e + 1) % 3);
                float ex = c[0] - a[0], ey = c[1] - a[1], n = fmaxf(sqrtf(ex * ex + ey * ey), 1e-6f);
                cover = fminf(cover, clamp01(sign * (ex * (y - a[1]) - ey * (x - a[0])) / n + 0.5f));
            }
            if (cover > 0.0f) blend(canvas, i, j, color, cover);
        }
}

float fs_canvas_text_width(const char *text, float height)
{
    return height / 6.0f * 5.6f * (float)strlen(text);
}

float fs_canvas_text(Canvas *canvas, float x, float y, float height, float thick, const char *text, Color color)
{
    float unit = height / 6.0f;
    for (const char *t = text; *t; t++, x += 5.6f * unit) {
        bool pen_down = false;
        float px = 0, py = 0;
        for (const char *s = fs_letters_strokes(*t); s && *s; s++) {
            if (*s == ' ') {
                pen_down = false;
                continue;
            }
            float qx = x + unit * (float)(s[0] - '0'), qy = y + unit * (float)(s[1] - '0');
            if (pen_down) fs_canvas_line(canvas, px, py, qx, qy, thick, color);
            pen_down = true;
            px = qx;
            py = qy;
            s++;
        }
    }
    return fs_canvas_text_width(text, height);
}

static float lattice(uint32_t seed, int x, int y)
{
    uint32_t h = seed ^ ((uint32_t)x * 0x8da6b343u) ^ ((uint32_t)y * 0xd8163841u);
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return (float)((h ^ (h >> 15)) >> 8) * 0x1p-23f - 1.0f;
}

float fs_canvas_noise_at(uint32_t seed, float x, float y, int octaves)
{
    float sum = 0.0f, weight = 0.5f, total = 0.0f;
    for (int o = 0; o < octaves; o++) {
        float fx = floorf(x), fy = floorf(y), u = x - fx, v = y - fy;
        int ix = (int)fx, iy = (int)fy;
        u = u * u * (3 - 2 * u);
        v = v * v * (3 - 2 * v);
        float a = lattice(seed, ix, iy), b = lattice(seed, ix + 1, iy), c = lattice(seed, ix, iy + 1),
              d = lattice(seed, ix + 1, iy + 1);
        sum += weight * (a + (b - a) * u + (c - a + (a - b - c + d) * u) * v);
        total += weight;
        weight *= 0.5f;
        x = x * 2.03f + 17.1f;
        y = y * 2.03f + 5.7f;
        seed = seed * 747796405u + 1u;
    }
    return sum / total;
}

void fs_canvas_noise(Canvas *canvas, float cell_x, float cell_y, int octaves, float amplitude, Color tint, Rng *rng)
{
    uint32_t seed = fs_rng_u32(rng);
    float kx = 1.0f / (canvas->scale * cell_x), ky = 1.0f / (canvas->scale * cell_y);
    for (int y = 0; y < canvas->height; y++)
        for (int x = 0; x < canvas->width; x++) {
            float v = amplitude * fs_canvas_noise_at(seed, (float)x * kx, (float)y * ky, octaves);
            float *p = canvas->px + ((size_t)y * (size_t)canvas->width + (size_t)x) * 3;
            p[0] = clamp01(p[0] + v * tint.x);
            p[1] = clamp01(p[1] + v * tint.y);
            p[2] = clamp01(p[2] + v * tint.z);
        }
}

Color fs_canvas_hsv(float hue, float saturation, float value)
{
    float h = (hue - floorf(hue)) * 6.0f;
    saturation *= 0.8f; // printed things are never quite pure
    float r = clamp01(fabsf(h - 3.0f) - 1.0f), g = clamp01(2.0f - fabsf(h - 2.0f)), b = clamp01(2.0f - fabsf(h - 4.0f));
    return vec(value * (1 - saturation * (1 - r)), value * (1 - saturation * (1 - g)),
               value * (1 - saturation * (1 - b)));
}

Color fs_canvas_mix(Color a, Color b, float t)
{
    return vec_mad(a, vec_sub(b, a), t);
}

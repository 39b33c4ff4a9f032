// Headings, small print, charts, pictures.
#include "synth/paint_parts.h"

#include <stdbool.h>

#include "synth/letters.h"

Color fs_paint_parts_color(Rng *rng, Vec low_hsv, Vec high_hsv)
{
    float h = fs_rng_range(rng, low_hsv.x, high_hsv.x), s = fs_rng_range(rng, low_hsv.y, high_hsv.y);
    float v = fs_rng_range(rng, low_hsv.z, high_hsv.z);
    return fs_canvas_hsv(h, s, v);
}

Palette fs_paint_parts_palette(float hue, Rng *rng)
{
    float h = hue < 0 ? fs_rng_uniform(rng) : hue + fs_rng_range(rng, -0.04f, 0.04f);
    float other = h + fs_rng_range(rng, 0.3f, 0.7f);
    Palette p;
    p.paper = fs_paint_parts_color(rng, vec(h + 0.05f, 0.03f, 0.78f), vec(h + 0.05f, 0.16f, 0.9f));
    p.ink = fs_paint_parts_color(rng, vec(h, 0.3f, 0.15f), vec(h, 0.3f, 0.28f));
    p.main = fs_paint_parts_color(rng, vec(h, 0.35f, 0.5f), vec(h, 0.75f, 0.82f));
    p.second = fs_paint_parts_color(rng, vec(other, 0.35f, 0.55f), vec(other, 0.7f, 0.85f));
    p.accent = fs_paint_parts_color(rng, vec(other + 0.2f, 0.55f, 0.55f), vec(other + 0.2f, 0.85f, 0.85f));
    return p;
}

float fs_paint_parts_heading(Canvas *c, Rect at, int words, Color color, Rng *rng)
{
    char text[80];
    fs_letters_words(rng, words, text, (int)sizeof text);
    float height = fminf(at.h, at.h * at.w / fmaxf(fs_canvas_text_width(text, at.h), 1e-3f));
    fs_canvas_text(c, at.x, at.y, height, height * fs_rng_range(rng, 0.13f, 0.24f), text, color);
    return height;
}

static void mark(Canvas *c, float x, float y, float line, Color color, Rng *rng)
{
    float drop = fs_rng_range(rng, 0.0f, 0.4f), w = fs_rng_range(rng, 0.3f, 0.6f), h = fs_rng_range(rng, 0.5f, 0.9f);
    fs_canvas_rect(c, x, y + line * drop, line * w, line * h, color);
}

void fs_paint_parts_column(Canvas *c, Rect at, float line, Color color, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    bool legible = line * c->scale > 7.0f;
    for (float yy = y; yy + line < y + h; yy += 1.7f * line) {
        float end = fs_rng_below(rng, 6) == 0 ? x + w * fs_rng_range(rng, 0.3f, 0.8f) : x + w;
        for (float xx = x; xx < end;) {
            const char *word = fs_letters_word(rng);
            float width = fs_canvas_text_width(word, line) * 0.9f;
            if (xx + width > end) break;
            if (legible)
                fs_canvas_text(c, xx, yy, line, 0.16f * line, word, color);
            else
                for (float g = 0; g < width - 0.5f * line; g += 0.75f * line) // letters too small to draw: uneven marks
                    mark(c, xx + g, yy, line, color, rng);
            xx += width + 0.6f * line;
        }
    }
}

void fs_paint_parts_chart(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    fs_canvas_rect(c, x, y, w, h, fs_canvas_mix(p->paper, vec(1, 1, 1), 0.4f));
    fs_canvas_border(c, x, y, w, h, 0.012f * w, p->ink);
    int bars = 4 + fs_rng_below(rng, 5);
    for (int i = 0; i < bars; i++) {
        float bh = h * fs_rng_range(rng, 0.1f, 0.85f), bw = 0.9f * w / (float)bars;
        Color color = fs_paint_parts_color(rng, vec(0, 0.6f, 0.4f), vec(1, 0.6f, 0.85f));
        fs_canvas_rect(c, x + 0.05f * w + bw * (float)i + 0.15f * bw, y + 0.95f * h - bh, 0.7f * bw, bh, color);
    }
    float px = x + 0.06f * w, py = y + h * fs_rng_range(rng, 0.2f, 0.7f);
    for (int i = 1; i < 8; i++) {
        float qx = x + 0.06f * w + 0.88f * w * (float)i / 7.0f, qy = y + h * fs_rng_range(rng, 0.1f, 0.8f);
        fs_canvas_line(c, px, py, qx, qy, 0.012f * w, p->ink);
        fs_canvas_disc(c, qx, qy, 0.015f * w, p->accent);
        px = qx;
        py = qy;
    }
}

static void landscape(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    fs_canvas_gradient(c, x, y, w, h, fs_canvas_mix(p->second, vec(0.8f, 0.9f, 1), 0.5f), p->paper);
    fs_canvas_disc(c, x + w * fs_rng_range(rng, 0.2f, 0.8f), y + 0.25f * h, 0.08f * h, vec(0.95f, 0.85f, 0.5f));
    for (int layer = 0; layer < 4; layer++) {
        float base = y + h * (0.45f + 0.14f * (float)layer), rough = h * (0.22f - 0.04f * (float)layer);
        Color color = fs_canvas_mix(fs_canvas_hsv(fs_rng_uniform(rng), 0.4f, 0.7f), p->ink, 0.18f * (float)layer);
        uint32_t seed = fs_rng_u32(rng);
        float step = fmaxf(w / 160.0f, 1.0f / c->scale);
        for (float xx = x; xx < x + w; xx += step) {
            float top = base + rough * fs_canvas_noise_at(seed, 5.0f * (xx - x) / w, 0.5f, 4);
            fs_canvas_gradient(c, xx, top, fminf(step, x + w - xx), y + h - top, color,
                               fs_canvas_mix(color, p->ink, 0.4f));
        }
    }
}

static void shapes(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    fs_canvas_gradient(c, x, y, w, h, p->main, p->second);
    float least = fminf(w, h);
    for (int i = 0; i < 14; i++) {
        Color color = fs_paint_parts_color(rng, vec(0, 0.2f, 0.2f), vec(1, 0.8f, 0.9f));
        float r = least * fs_rng_range(rng, 0.04f, 0.18f), cx = fs_rng_range(rng, x + r, x + w - r),
              cy = fs_rng_range(rng, y + r, y + h - r);
        switch (fs_rng_below(rng, 4)) {
        case 0: fs_canvas_disc(c, cx, cy, r, color); break;
        case 1: fs_canvas_ring(c, cx, cy, 0.8f * r, 0.35f * r, color); break;
        case 2: fs_canvas_rect(c, cx - r, cy - 0.6f * r, 2 * r, 1.2f * r, color); break;
        default: {
            float t[6] = {cx - r, cy + r, cx + r, cy + 0.8f * r, cx + 0.2f * r, cy - r};
            fs_canvas_triangle(c, t, color);
        }
        }
    }
}

// A "photo": warped noise in a few tones, with dark edges.
static void photo(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    uint32_t seed = fs_rng_u32(rng);
    float step = fmaxf(1.0f / c->scale, w / 90.0f), k = fs_rng_range(rng, 3.0f, 6.0f) / w;
    for (float yy = y; yy < y + h; yy += step)
        for (float xx = x; xx < x + w; xx += step) {
            float warp = fs_canvas_noise_at(seed, k * xx, k * yy, 2);
            float v = fs_canvas_noise_at(seed + 7, 1.4f * k * xx + 2 * warp, k * yy - warp, 5);
            float t = 0.5f + 1.1f * v;
            Color low = fs_canvas_mix(p->ink, p->main, t * 1.6f), high = fs_canvas_mix(p->second, p->paper, t);
            Color color = fs_canvas_mix(low, high, t < 0.45f ? 0.0f : t > 0.6f ? 1.0f : (t - 0.45f) / 0.15f);
            color = vec(fmaxf(color.x, 0.03f), fmaxf(color.y, 0.03f), fmaxf(color.z, 0.03f));
            fs_canvas_rect(c, xx, yy, fminf(step, x + w - xx), fminf(step, y + h - yy), color);
        }
}

static void blobs(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    enum { N = 18 };
    float cx[N], cy[N];
    Color color[N];
    for (int i = 0; i < N; i++) {
        cx[i] = fs_rng_range(rng, x, x + w);
        cy[i] = fs_rng_range(rng, y, y + h);
        color[i] = fs_paint_parts_color(rng, vec(0, 0.3f, 0.25f), vec(1, 0.8f, 0.9f));
    }
    float step = fmaxf(1.0f / c->scale, w / 160.0f), edge = 0.03f * fminf(w, h);
    for (float yy = y; yy < y + h; yy += step)
        for (float xx = x; xx < x + w; xx += step) { // cells of the nearest of N points, dark joints between them
            float best = 1e9f, second = 1e9f;
            int which = 0;
            for (int i = 0; i < N; i++) {
                float d = hypotf(xx - cx[i], yy - cy[i]);
                if (d < best) {
                    second = best;
                    best = d;
                    which = i;
                } else if (d < second) {
                    second = d;
                }
            }
            Color here = second - best < edge ? p->ink : color[which];
            fs_canvas_rect(c, xx, yy, fminf(step, x + w - xx), fminf(step, y + h - yy), here);
        }
}

void fs_paint_parts_picture(Canvas *c, Rect at, const Palette *p, Rng *rng)
{
    switch (fs_rng_below(rng, 5)) {
    case 0: landscape(c, at, p, rng); break;
    case 1: shapes(c, at, p, rng); break;
    case 2: blobs(c, at, p, rng); break;
    default: photo(c, at, p, rng); break;
    }
}

void fs_paint_parts_barcode(Canvas *c, Rect at, Rng *rng)
{
    float x = at.x, y = at.y, w = at.w, h = at.h;
    fs_canvas_rect(c, x, y, w, h, vec(0.88f, 0.88f, 0.86f));
    for (float xx = x + 0.05f * w; xx < x + 0.93f * w;) {
        float bar = w * fs_rng_range(rng, 0.01f, 0.05f);
        fs_canvas_rect(c, xx, y + 0.08f * h, bar, 0.75f * h, vec(0.1f, 0.1f, 0.1f));
        xx += bar + w * fs_rng_range(rng, 0.015f, 0.05f);
    }
}

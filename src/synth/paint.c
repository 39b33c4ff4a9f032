// One function per kind of texture, in a table in the order of Paint.
#include "synth/paint.h"

#include <stdbool.h>

#include "synth/paint_parts.h"

#define WHITE vec(1, 1, 1)

static void grain(Canvas *c, float amplitude, Rng *rng) // keeps flat areas from being computer-flat
{
    fs_canvas_noise(c, 0.6f, 0.6f, 3, amplitude, WHITE, rng);
    fs_canvas_noise(c, 0.4f * c->w + 0.1f, 0.4f * c->h + 0.1f, 2, amplitude, WHITE, rng);
}

// One hue (any when negative), saturation and value from ranges.
static Color tone(Rng *rng, float hue, float s0, float s1, float v0, float v1)
{
    if (hue < 0) hue = fs_rng_uniform(rng);
    return fs_paint_parts_color(rng, vec(hue, s0, v0), vec(hue, s1, v1));
}

static void poster(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    float m = 0.05f * c->w, w = c->w - 2 * m, head = 0.13f * c->h;
    fs_canvas_fill(c, p.paper);
    fs_canvas_rect(c, 0, 0, c->w, head, fs_rng_below(rng, 2) ? p.ink : p.main);
    fs_paint_parts_heading(c, (Rect){m, 0.25f * head, w, 0.5f * head}, 2, p.paper, rng);
    float y = head + 0.5f * m;
    y += 1.6f * fs_paint_parts_heading(c, (Rect){m, y, w, 0.035f * c->h}, 3, p.ink, rng);
    int columns = c->w > 1.2f * c->h ? 3 : 2;
    float cw = w / (float)columns - 0.3f * m;
    for (int k = 0; k < columns; k++) {
        float x = m + (float)k * (w / (float)columns), yy = y;
        while (yy < c->h - 3 * m) {
            float h = fminf(c->h * fs_rng_range(rng, 0.12f, 0.26f), c->h - m - yy);
            switch (fs_rng_below(rng, 5)) {
            case 0: fs_paint_parts_chart(c, (Rect){x, yy, cw, h}, &p, rng); break;
            case 1:
            case 2: fs_paint_parts_picture(c, (Rect){x, yy, cw, h}, &p, rng); break;
            default:
                fs_paint_parts_heading(c, (Rect){x, yy, cw, 0.025f * c->h}, 2, p.main, rng);
                fs_paint_parts_column(c, (Rect){x, yy + 0.04f * c->h, cw, h - 0.04f * c->h}, fmaxf(0.011f * c->h, 0.5f),
                                      p.ink, rng);
            }
            yy += h + 0.4f * m;
        }
    }
    fs_canvas_border(c, 0, 0, c->w, c->h, 0.008f * c->w, p.main);
    grain(c, 0.02f, rng);
}

static void art(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    fs_canvas_fill(c, p.ink);
    float m = 0.04f * fminf(c->w, c->h), f = 2.2f * m; // frame, mat, picture
    fs_canvas_rect(c, m, m, c->w - 2 * m, c->h - 2 * m, p.paper);
    fs_paint_parts_picture(c, (Rect){f, f, c->w - 2 * f, c->h - 2 * f}, &p, rng);
    grain(c, 0.03f, rng);
}

static void news(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    p.paper = vec(0.8f, 0.78f, 0.72f);
    p.main = vec(0.45f, 0.44f, 0.42f);
    p.second = vec(0.62f, 0.6f, 0.58f);
    p.ink = vec(0.13f, 0.13f, 0.13f);
    float m = 0.05f * c->w, y = m;
    fs_canvas_fill(c, p.paper);
    y += fs_paint_parts_heading(c, (Rect){m, y, c->w - 2 * m, 0.09f * c->h}, 2, p.ink, rng) + 0.4f * m;
    fs_canvas_rect(c, m, y, c->w - 2 * m, 0.006f * c->h, p.ink);
    y += 0.4f * m;
    fs_paint_parts_picture(c, (Rect){m, y, 0.55f * c->w, 0.3f * c->h}, &p, rng);
    fs_paint_parts_heading(c, (Rect){0.63f * c->w, y, 0.3f * c->w, 0.035f * c->h}, 2, p.ink, rng);
    fs_paint_parts_column(c, (Rect){0.63f * c->w, y + 0.05f * c->h, 0.3f * c->w, 0.25f * c->h}, 0.6f, p.ink, rng);
    y += 0.32f * c->h;
    for (int k = 0; k < 3; k++)
        fs_paint_parts_column(c, (Rect){m + (float)k * 0.31f * c->w, y, 0.27f * c->w, c->h - y - m}, 0.6f, p.ink, rng);
    grain(c, 0.02f, rng);
}

static void cover(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    fs_canvas_gradient(c, 0, 0, c->w, c->h, p.main, fs_canvas_mix(p.main, p.ink, 0.5f));
    float m = 0.06f * c->w, h = fs_paint_parts_heading(c, (Rect){m, m, c->w - 2 * m, 0.16f * c->h}, 1, p.paper, rng);
    fs_paint_parts_picture(c, (Rect){m, 2 * m + h, c->w - 2 * m, c->h * 0.5f}, &p, rng);
    fs_paint_parts_heading(c, (Rect){m, 3 * m + h + 0.5f * c->h, 0.8f * c->w, 0.06f * c->h}, 2, p.accent, rng);
    fs_paint_parts_column(c, (Rect){m, 3 * m + h + 0.6f * c->h, 0.7f * c->w, 0.14f * c->h}, 0.03f * c->h, p.paper, rng);
    grain(c, 0.02f, rng);
}

static void label(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    fs_canvas_fill(c, p.main);
    float w = c->w, h = c->h, band = h * fs_rng_range(rng, 0.3f, 0.5f), y = h * fs_rng_range(rng, 0.1f, 0.4f);
    if (fs_rng_below(rng, 2))
        for (int i = 0; i < 24; i++)
            fs_canvas_disc(c, w * fs_rng_uniform(rng), h * (float)i / 24, 0.05f * w,
                           fs_canvas_mix(p.main, p.accent, 0.6f));
    else
        for (float x = 0; x < w; x += 0.14f * w)
            fs_canvas_rect(c, x, 0, 0.05f * w, h, fs_canvas_mix(p.main, p.second, 0.6f));
    fs_canvas_rect(c, 0, y, w, band, p.paper);
    fs_canvas_rect(c, 0, y, w, 0.06f * band, p.second);
    fs_canvas_rect(c, 0, y + 0.94f * band, w, 0.06f * band, p.second);
    float used = fs_paint_parts_heading(c, (Rect){0.08f * w, y + 0.16f * band, 0.84f * w, 0.4f * band}, 1, p.ink, rng);
    fs_paint_parts_column(c, (Rect){0.08f * w, y + 0.26f * band + used, 0.5f * w, 0.62f * band - used}, 0.07f * band,
                          p.ink, rng);
    fs_canvas_disc(c, 0.78f * w, y + 0.7f * band, 0.13f * fminf(w, band), p.accent);
    fs_paint_parts_barcode(c, (Rect){0.62f * w, 0.8f * h, 0.3f * w, 0.13f * h}, rng);
    fs_paint_parts_picture(
        c, (Rect){0.06f * w, y + band + 0.05f * h, 0.45f * w, fmaxf(0.85f * h - y - band, 0.06f * h)}, &p, rng);
    grain(c, 0.025f, rng);
}

static void carton(Canvas *c, float hue, Rng *rng)
{
    Color board = fs_canvas_hsv(0.085f + 0.02f * (hue < 0 ? 0.5f : hue), 0.4f, fs_rng_range(rng, 0.55f, 0.7f));
    Color ink = fs_canvas_mix(board, vec(0.1f, 0.08f, 0.06f), 0.75f);
    fs_canvas_fill(c, board);
    fs_canvas_noise(c, 30.0f, 0.35f, 2, 0.035f, WHITE, rng);
    fs_canvas_rect(c, 0, 0.44f * c->h, c->w, 0.1f * c->h, fs_canvas_mix(board, vec(0.8f, 0.72f, 0.5f), 0.6f));
    fs_paint_parts_heading(c, (Rect){0.08f * c->w, 0.12f * c->h, 0.6f * c->w, 0.2f * c->h}, 1, ink, rng);
    fs_paint_parts_column(c, (Rect){0.08f * c->w, 0.62f * c->h, 0.45f * c->w, 0.28f * c->h}, 0.045f * c->h, ink, rng);
    fs_paint_parts_barcode(c, (Rect){0.62f * c->w, 0.62f * c->h, 0.3f * c->w, 0.26f * c->h}, rng);
    fs_canvas_border(c, 0.74f * c->w, 0.08f * c->h, 0.18f * c->w, 0.24f * c->h, 0.02f * c->w, ink);
    grain(c, 0.03f, rng);
}

static void books(Canvas *c, float hue, Rng *rng)
{
    (void)hue;
    fs_canvas_fill(c, vec(0.12f, 0.1f, 0.09f));
    for (float x = 0.2f; x < c->w;) {
        float w = fminf(fs_rng_range(rng, 1.6f, 4.5f), c->w - x), h = c->h * fs_rng_range(rng, 0.7f, 0.97f);
        Palette p = fs_paint_parts_palette(-1, rng);
        Color cloth = fs_canvas_mix(p.main, p.ink, fs_rng_range(rng, 0.0f, 0.5f));
        fs_canvas_rect(c, x, c->h - h, 0.94f * w, h, cloth);
        fs_canvas_rect(c, x, c->h - 0.88f * h, 0.94f * w, 0.03f * h, p.accent);
        fs_canvas_rect(c, x, c->h - 0.2f * h, 0.94f * w, 0.05f * h, p.paper);
        for (float y = c->h - 0.8f * h; y < c->h - 0.3f * h; y += 0.55f * w) // the title, letter under letter
            fs_canvas_text(c, x + 0.28f * w, y, 0.42f * w, 0.09f * w,
                           (const char[]){(char)('A' + fs_rng_below(rng, 26)), 0}, p.paper);
        x += w;
    }
    grain(c, 0.03f, rng);
}

static void fabric(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    float cell = fs_rng_range(rng, 6.0f, 11.0f);
    fs_canvas_fill(c, p.main);
    for (int axis = 0; axis < 2; axis++)
        for (float t = 0; t < (axis ? c->h : c->w); t += cell) {
            const float at[4] = {0.0f, 0.35f, 0.5f, 0.8f}, wide[4] = {0.16f, 0.04f, 0.04f, 0.1f};
            for (int i = 0; i < 4; i++) {
                Color color = fs_canvas_mix(p.main, i & 1 ? p.paper : i ? p.accent : p.ink, 0.5f);
                if (axis)
                    fs_canvas_rect(c, 0, t + at[i] * cell, c->w, wide[i] * cell, fs_canvas_mix(color, p.main, 0.35f));
                else
                    fs_canvas_rect(c, t + at[i] * cell, 0, wide[i] * cell, c->h, color);
            }
        }
    fs_canvas_noise(c, 0.25f, 0.25f, 2, 0.09f, WHITE, rng);
    grain(c, 0.03f, rng);
}

static void floral(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    fs_canvas_fill(c, fs_canvas_mix(p.main, p.ink, 0.3f));
    for (float y = 2; y < c->h; y += 5.5f)
        for (float x = 2; x < c->w; x += 5.5f) {
            float cx = x + fs_rng_range(rng, -1.2f, 1.2f), cy = y + fs_rng_range(rng, -1.2f, 1.2f);
            float r = fs_rng_range(rng, 0.8f, 1.5f), turn = fs_rng_range(rng, 0, 1.2f);
            Color petal = fs_rng_below(rng, 2) ? p.paper : p.second;
            for (int i = 0; i < 5; i++)
                fs_canvas_disc(c, cx + r * cosf(turn + 1.2566f * (float)i), cy + r * sinf(turn + 1.2566f * (float)i),
                               0.6f * r, petal);
            fs_canvas_disc(c, cx, cy, 0.5f * r, p.accent);
        }
    fs_canvas_noise(c, 0.25f, 0.25f, 2, 0.06f, WHITE, rng);
}

static void wood(Canvas *c, float hue, Rng *rng)
{
    float h = hue < 0 ? fs_rng_range(rng, 0.05f, 0.1f) : 0.04f + 0.07f * hue;
    fs_canvas_fill(c, tone(rng, h, 0.35f, 0.55f, 0.42f, 0.62f));
    fs_canvas_noise(c, 1.2f, 26.0f, 4, 0.22f, vec(1, 0.85f, 0.7f), rng);
    fs_canvas_noise(c, 0.3f, 7.0f, 2, 0.1f, WHITE, rng);
    for (float x = 0; x < c->w; x += 14.0f) fs_canvas_rect(c, x, 0, 0.25f, c->h, fs_canvas_hsv(h, 0.5f, 0.24f));
}

static void plaster(Canvas *c, float hue, Rng *rng)
{
    fs_canvas_fill(c, tone(rng, hue, 0.06f, 0.2f, 0.7f, 0.84f));
    fs_canvas_noise(c, 40.0f, 40.0f, 4, 0.1f, WHITE, rng);
    fs_canvas_noise(c, 1.2f, 1.2f, 3, 0.07f, WHITE, rng);
}

static void stained(Canvas *c, float hue, Rng *rng)
{
    plaster(c, hue < 0 ? 0.1f : hue, rng);
    fs_canvas_noise(c, 18.0f, 25.0f, 5, 0.2f, vec(0.8f, 0.95f, 1.0f), rng);
    for (int i = 0; i < 9; i++) { // cracks
        float x = fs_rng_range(rng, 0, c->w), y = fs_rng_range(rng, 0, c->h), a = fs_rng_range(rng, 0, 6.28f);
        for (int k = 0; k < 14; k++) {
            float nx = x + 4 * cosf(a), ny = y + 4 * sinf(a);
            fs_canvas_line(c, x, y, nx, ny, 0.22f, vec(0.3f, 0.27f, 0.24f));
            a += fs_rng_range(rng, -0.7f, 0.7f);
            x = nx;
            y = ny;
        }
    }
}

static void panels(Canvas *c, float hue, Rng *rng)
{
    float base = fs_rng_range(rng, 0.64f, 0.78f), h = hue < 0 ? 0.1f : hue;
    for (float y = 0; y < c->h; y += 40.0f)
        for (float x = 0; x < c->w; x += 60.0f)
            fs_canvas_rect(c, x, y, 60, 40, fs_canvas_hsv(h, 0.12f, base + fs_rng_range(rng, -0.05f, 0.05f)));
    fs_canvas_noise(c, 9.0f, 9.0f, 5, 0.13f, vec(1, 0.95f, 0.9f), rng);
    for (float y = 0; y < c->h; y += 40.0f) fs_canvas_rect(c, 0, y, c->w, 0.8f, vec(0.28f, 0.26f, 0.25f));
    for (float x = 0; x < c->w; x += 60.0f) fs_canvas_rect(c, x, 0, 0.8f, c->h, vec(0.28f, 0.26f, 0.25f));
    for (float y = 4; y < c->h; y += 40.0f)
        for (float x = 4; x < c->w; x += 26.0f) fs_canvas_disc(c, x, y, 0.6f, vec(0.35f, 0.34f, 0.33f));
}

static void brick(Canvas *c, float hue, Rng *rng)
{
    float h = hue < 0 ? 0.03f : hue;
    fs_canvas_fill(c, vec(0.62f, 0.6f, 0.57f));
    int row = 0;
    for (float y = 0; y < c->h; y += 7.5f, row++)
        for (float x = row & 1 ? -12.0f : 0.0f; x < c->w; x += 24.0f)
            fs_canvas_rect(c, x + 0.5f, y + 0.5f, 23, 6.5f,
                           fs_paint_parts_color(rng, vec(h - 0.02f, 0.25f, 0.42f), vec(h + 0.02f, 0.5f, 0.68f)));
    fs_canvas_noise(c, 2.5f, 2.5f, 4, 0.13f, WHITE, rng);
}

static void tiles(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    for (float y = 0; y < c->h; y += 20.0f)
        for (float x = 0; x < c->w; x += 20.0f) {
            Color color = fs_canvas_mix(p.paper, p.main, fs_rng_range(rng, 0.05f, 0.35f));
            fs_canvas_rect(c, x, y, 20, 20, color);
            fs_canvas_ring(c, x + 10, y + 10, 6, 0.6f, fs_canvas_mix(color, p.ink, 0.25f));
        }
    for (float y = 0; y < c->h; y += 20.0f) fs_canvas_rect(c, 0, y, c->w, 0.6f, vec(0.35f, 0.34f, 0.33f));
    for (float x = 0; x < c->w; x += 20.0f) fs_canvas_rect(c, x, 0, 0.6f, c->h, vec(0.35f, 0.34f, 0.33f));
    fs_canvas_noise(c, 6.0f, 6.0f, 5, 0.1f, WHITE, rng);
}

static void carpet(Canvas *c, float hue, Rng *rng)
{
    fs_canvas_fill(c, tone(rng, hue, 0.25f, 0.25f, 0.4f, 0.52f));
    fs_canvas_noise(c, 0.5f, 0.5f, 2, 0.25f, vec(1, 0.95f, 0.9f), rng);
    fs_canvas_noise(c, 6.0f, 6.0f, 4, 0.2f, WHITE, rng);
}

static void stone(Canvas *c, float hue, Rng *rng)
{
    fs_canvas_fill(c, fs_canvas_hsv(hue < 0 ? 0.6f : hue, 0.06f, fs_rng_range(rng, 0.46f, 0.56f)));
    fs_canvas_noise(c, 5.0f, 5.0f, 5, 0.22f, WHITE, rng);
    for (int i = 0, n = (int)(c->w * c->h * 0.25f); i < n; i++) {
        float x = fs_rng_range(rng, 0, c->w), y = fs_rng_range(rng, 0, c->h), r = fs_rng_range(rng, 0.08f, 0.35f);
        fs_canvas_disc(c, x, y, r, tone(rng, 0.6f, 0.08f, 0.08f, 0.22f, 0.78f));
    }
}

static void stripes(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    const Color colors[4] = {p.main, p.paper, p.second, p.ink};
    for (float y = 0; y < c->h;) {
        float h = fs_rng_range(rng, 1.0f, 5.0f);
        fs_canvas_rect(c, 0, y, c->w, h, colors[fs_rng_below(rng, 4)]);
        y += h;
    }
    fs_canvas_noise(c, 0.3f, 0.3f, 2, 0.07f, WHITE, rng);
    grain(c, 0.03f, rng);
}

static void checker(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    float cell = c->w / (float)(4 + fs_rng_below(rng, 4));
    for (int j = 0; (float)j * cell < c->h; j++)
        for (int i = 0; (float)i * cell < c->w; i++)
            fs_canvas_rect(c, (float)i * cell, (float)j * cell, cell, cell,
                           (i + j) & 1 ? p.paper : fs_canvas_mix(p.main, p.second, fs_rng_uniform(rng)));
    grain(c, 0.05f, rng);
}

static void metal(Canvas *c, float hue, Rng *rng)
{
    fs_canvas_fill(c, fs_canvas_hsv(hue < 0 ? 0.6f : hue, 0.07f, fs_rng_range(rng, 0.55f, 0.68f)));
    fs_canvas_noise(c, 20.0f, 0.2f, 3, 0.09f, WHITE, rng);
    for (int i = 0; i < 25; i++) {
        float x = fs_rng_range(rng, 0, c->w), y = fs_rng_range(rng, 0, c->h);
        float dx = fs_rng_range(rng, -3, 3), dy = fs_rng_range(rng, -1, 1);
        fs_canvas_line(c, x, y, x + dx, y + dy, 0.06f, vec(0.35f, 0.35f, 0.36f));
    }
}

static void door(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    Color leaf = fs_canvas_mix(p.paper, p.main, fs_rng_range(rng, 0.0f, 0.7f)),
          dark = fs_canvas_mix(leaf, p.ink, 0.45f);
    fs_canvas_fill(c, leaf);
    int rows = 2 + fs_rng_below(rng, 3);
    bool panes = fs_rng_below(rng, 2);
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < 2; i++) {
            float w = 0.36f * c->w, h = 0.84f * c->h / (float)rows, x = (0.1f + 0.44f * (float)i) * c->w,
                  y = 0.06f * c->h + (float)j * 0.9f * c->h / (float)rows;
            Color fill = panes && j < rows - 1 ? vec(0.55f, 0.66f, 0.7f) : fs_canvas_mix(leaf, dark, 0.25f);
            fs_canvas_gradient(c, x, y, w, h, fill, fs_canvas_mix(fill, dark, 0.4f));
            fs_canvas_border(c, x, y, w, h, 0.02f * c->w, dark);
        }
    fs_canvas_rect(c, 0.86f * c->w, 0.47f * c->h, 0.08f * c->w, 0.06f * c->h, vec(0.75f, 0.7f, 0.5f));
    fs_canvas_disc(c, 0.9f * c->w, 0.49f * c->h, 0.03f * c->w, vec(0.35f, 0.32f, 0.25f));
    fs_paint_parts_heading(c, (Rect){0.2f * c->w, 0.015f * c->h, 0.6f * c->w, 0.03f * c->h}, 1, p.ink, rng);
    fs_canvas_noise(c, 2.0f, 25.0f, 3, 0.04f, WHITE, rng);
}

static void notes(Canvas *c, float hue, Rng *rng)
{
    (void)hue;
    fs_canvas_fill(c, vec(0.6f, 0.45f, 0.3f));
    fs_canvas_noise(c, 0.5f, 0.5f, 2, 0.2f, vec(1, 0.9f, 0.8f), rng);
    for (int i = 0; i < 16; i++) {
        Palette p = fs_paint_parts_palette(-1, rng);
        float w = c->w * fs_rng_range(rng, 0.12f, 0.24f), h = w * fs_rng_range(rng, 0.7f, 1.4f);
        float x = fs_rng_range(rng, 0, c->w - w), y = fs_rng_range(rng, 0, fmaxf(c->h - h, 0.01f));
        fs_canvas_rect(c, x, y, w, h, fs_rng_below(rng, 3) ? p.paper : p.second);
        if (fs_rng_below(rng, 3))
            fs_paint_parts_column(c, (Rect){x + 0.08f * w, y + 0.12f * h, 0.84f * w, 0.8f * h}, fmaxf(0.06f * h, 0.5f),
                                  p.ink, rng);
        else
            fs_paint_parts_picture(c, (Rect){x + 0.08f * w, y + 0.08f * h, 0.84f * w, 0.84f * h}, &p, rng);
        fs_canvas_disc(c, x + 0.5f * w, y + 0.04f * h, 0.5f, p.accent);
    }
    fs_canvas_border(c, 0, 0, c->w, c->h, 1.6f, vec(0.35f, 0.24f, 0.16f));
}

static void basket(Canvas *c, float hue, Rng *rng)
{
    float h = hue < 0 ? 0.09f : 0.06f + 0.05f * hue;
    int row = 0;
    for (float y = 0; y < c->h; y += 1.2f, row++)
        for (float x = row & 1 ? -1.2f : 0; x < c->w; x += 2.4f) {
            Color color = fs_canvas_hsv(h, 0.45f, fs_rng_range(rng, 0.42f, 0.68f));
            fs_canvas_gradient(c, x, y, 1.3f, 1.1f, color, fs_canvas_mix(color, vec(0.1f, 0.07f, 0.04f), 0.5f));
            fs_canvas_rect(c, x + 1.3f, y, 1.1f, 1.1f, fs_canvas_hsv(h, 0.5f, 0.25f));
        }
}

static void keys(Canvas *c, float hue, Rng *rng)
{
    Palette p = fs_paint_parts_palette(hue, rng);
    fs_canvas_fill(c, vec(0.2f, 0.2f, 0.22f));
    for (float y = 0.6f; y + 1.2f < c->h; y += 1.7f)
        for (float x = 0.6f; x + 1.2f < c->w;) {
            float w = fs_rng_below(rng, 9) ? 1.3f : 3.0f;
            w = fminf(w, c->w - x - 0.4f);
            fs_canvas_rect(c, x, y, w, 1.3f, fs_rng_below(rng, 8) ? vec(0.6f, 0.6f, 0.6f) : p.accent);
            fs_canvas_text(c, x + 0.3f, y + 0.3f, 0.6f, 0.13f, (const char[]){(char)('A' + fs_rng_below(rng, 26)), 0},
                           vec(0.12f, 0.12f, 0.13f));
            x += w + 0.4f;
        }
}

static void plain(Canvas *c, float hue, Rng *rng)
{
    fs_canvas_fill(c, tone(rng, hue, 0.05f, 0.35f, 0.55f, 0.75f));
    fs_canvas_noise(c, 60.0f, 60.0f, 2, 0.03f, WHITE, rng);
}

static void (*const painters[PAINTS])(Canvas *, float, Rng *) = {
    poster, art,   news,   cover, label,   carton,  books, fabric, floral, wood,   plaster, stained, panels,
    brick,  tiles, carpet, stone, stripes, checker, metal, door,   notes,  basket, keys,    plain,
};

int fs_paint_texture(Texture *texture, Paint paint, float hue, float w_cm, float h_cm, float px_per_cm, Rng *rng)
{
    Canvas canvas;
    *texture = (Texture){0};
    if (fs_canvas_new(&canvas, w_cm, h_cm, px_per_cm) < 0) return -1;
    painters[paint](&canvas, hue, rng);
    int rc = fs_texture_new(texture, &canvas);
    fs_canvas_free(&canvas);
    return rc;
}

// Parts that several painted textures share.
#pragma once

#include "synth/canvas.h"

typedef struct Rect {
    float x, y, w, h; // of its upper left corner, and its size
} Rect;

typedef struct Palette {
    Color paper, ink, main, second, accent;
} Palette;

Palette fs_paint_parts_palette(float hue, Rng *rng);
// A random colour between two HSV colours. (Draws in a fixed order: an argument list has none, and the same seed should
// make the same scene with every compiler.)
Color fs_paint_parts_color(Rng *rng, Vec low_hsv, Vec high_hsv);
// A heading that fills at most the width with capitals at most the height; returns the height used.
float fs_paint_parts_heading(Canvas *c, Rect at, int words, Color color, Rng *rng);
void fs_paint_parts_column(Canvas *c, Rect at, float line, Color color, Rng *rng); // small print
void fs_paint_parts_chart(Canvas *c, Rect at, const Palette *p, Rng *rng);
void fs_paint_parts_picture(Canvas *c, Rect at, const Palette *p, Rng *rng); // one of several
void fs_paint_parts_barcode(Canvas *c, Rect at, Rng *rng);

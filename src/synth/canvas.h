// A picture to paint textures on: display-coded (sRGB) colours, anti-aliased shapes, lettering, noise.
// Coordinates are centimetres from the top left corner.
#pragma once

#include "base/rng.h"
#include "synth/vec.h"

typedef Vec Color; // sRGB-coded, 0..1

typedef struct Canvas {
    int width, height; // pixels
    float w, h;        // centimetres
    float scale;       // pixels per centimetre
    float *px;         // (height, width, 3)
} Canvas;

int fs_canvas_new(Canvas *canvas, float w_cm, float h_cm, float px_per_cm); // negative: out of memory
void fs_canvas_free(Canvas *canvas);

void fs_canvas_fill(Canvas *canvas, Color color);
void fs_canvas_rect(Canvas *canvas, float x, float y, float w, float h, Color color);
void fs_canvas_border(Canvas *canvas, float x, float y, float w, float h, float thick, Color color);
void fs_canvas_gradient(Canvas *canvas, float x, float y, float w, float h, Color top, Color bottom);
void fs_canvas_disc(Canvas *canvas, float x, float y, float radius, Color color);
void fs_canvas_ring(Canvas *canvas, float x, float y, float radius, float thick, Color color);
void fs_canvas_line(Canvas *canvas, float x0, float y0, float x1, float y1, float thick, Color color);
void fs_canvas_triangle(Canvas *canvas, const float xy[6], Color color); // (3, 2)
// Upper-case letters, digits, blanks; height of the capitals in cm. Returns the width.
float fs_canvas_text(Canvas *canvas, float x, float y, float height, float thick, const char *text, Color color);
float fs_canvas_text_width(const char *text, float height);
// Smooth noise of period cell (cm) with so many octaves, amplitude added to every channel times tint.
void fs_canvas_noise(Canvas *canvas, float cell_x, float cell_y, int octaves, float amplitude, Color tint, Rng *rng);
// Value noise in -1..1, any point; the lattice is random by seed.
float fs_canvas_noise_at(uint32_t seed, float x, float y, int octaves);

Color fs_canvas_hsv(float hue, float saturation, float value);
Color fs_canvas_mix(Color a, Color b, float t);

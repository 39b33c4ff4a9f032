// A small built-in bitmap font (ASCII, fixed width) for labels on pictures.
#pragma once

#include "image/image.h"

#define FS_FONT_ADVANCE 6 // pixels from one character to the next, at scale 1
#define FS_FONT_HEIGHT 9  // 7 above the base line, 2 below

// Draws text with its upper left corner at (x, y), each font pixel a square of scale x scale; what falls outside of
// the image or beyond x_end is left out. Bytes outside of printable ASCII are drawn as one '?' per UTF-8 character.
void fs_font_draw(Image *image, int x, int y, int x_end, int scale, const float color[3], const char *text);

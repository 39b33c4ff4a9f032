// Colours for numbers: a perceptual map (dark violet, blue, green, yellow) whose lightness rises evenly, so that equal
// steps of the number look equal. Made in the CIELAB space rather than from a table.
#pragma once

#include "image/image.h"

void fs_colormap_color(float value, float rgb[3]); // value 0..1 (clamped) -> sRGB 0..1
// A depth map (1 channel) as a picture of 3, sRGB, the caller's: near is bright, depth 0 (no surface) is dark grey;
// even in 1/depth between the two depths.
int fs_colormap_depth(const Image *depth, float nearest, float farthest, Image *picture, FsError *err);
// Percentiles (0..1) of the positive values of an image; false when there are none.
bool fs_colormap_range(const Image *image, double low, double high, float *low_value, float *high_value);

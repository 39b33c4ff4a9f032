// Bayer mosaic to RGB in floats: no clipping, negative noise kept.
#pragma once

#include "image/image.h"

#define FS_DEMOSAIC_MIN_SIDE 16

// cfa: colours 0 R, 1 G, 2 B of the four pixels at the top left, row by row; the greens on one diagonal.
bool fs_demosaic_is_bayer(const unsigned char cfa[4]);
// mosaic (height, width), white-balanced and linear. Either side at least FS_DEMOSAIC_MIN_SIDE.
int fs_demosaic(const float *mosaic, int width, int height, const unsigned char cfa[4], Image *rgb, FsError *err);

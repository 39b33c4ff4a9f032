// Bayer mosaic to RGB in floats: no clipping, negative noise kept.
#pragma once

#include "base/error.h"

#define FS_DEMOSAIC_MIN_SIDE 16

// cfa: colours 0 R, 1 G, 2 B of the four pixels at the top left, row by row; the greens on one diagonal.
bool fs_demosaic_is_bayer(const unsigned char cfa[4]);
// Where the rows of a mosaic come from and those of the picture go to, from the top.
typedef struct DemosaicRows {
    void (*get)(const void *user, int y, float *mosaic); // (width) white-balanced and linear; a row may be asked twice
    void (*put)(void *user, int y, const float *rgb);    // (width, 3)
    void *user;
} DemosaicRows;
// Either side at least FS_DEMOSAIC_MIN_SIDE.
int fs_demosaic(const DemosaicRows *rows, int width, int height, const unsigned char cfa[4], FsError *err);

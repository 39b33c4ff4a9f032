// Contact sheets: labelled pictures in a grid, as one PNG to look at.
#pragma once

#include "image/image.h"

typedef struct SheetTile {
    const Image *image; // 1 or 3 channels, display values 0..1; NULL or without pixels: the cell stays empty
    const char *label;  // one line above the picture; NULL for none
} SheetTile;

// Lays tiles out row by row, `columns` to a row; a column is as wide as its widest tile, a row as high as its highest.
int fs_sheet_draw(Image *sheet, const SheetTile *tiles, int n, int columns, FsError *err);
// The same as an 8-bit RGB PNG.
int fs_sheet_write(const char *path, const SheetTile *tiles, int n, int columns, FsError *err);

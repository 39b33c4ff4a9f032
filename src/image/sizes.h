// A photo brought to sizes as its rows come, by area averages, so that a large one is never whole in memory.
#pragma once

#include "image/image.h"

typedef struct PhotoSize {
    int long_edge;      // wanted: the longer side at most; 0: as shot
    Image rgb, clipped; // clipped (1 channel): share of the pixel that is not to be trusted
    Resize of_rgb, of_clipped;
} PhotoSize;

enum { PHOTO_SIZES = 3 };
typedef struct PhotoSizes {
    int n;
    PhotoSize size[PHOTO_SIZES]; // long_edge is the caller's, the rest is made
    int enough;                  // for a look: a longer side of so many pixels may be read for the photo; 0: all of it
    int width, height;           // as read: as stored, or less of it
    float white;                 // where the first of the colours clips, in linear light; 1 but where a reader says so
} PhotoSizes;

void fs_sizes_clear(PhotoSizes *sizes); // no pictures yet, whatever was there; what is wanted stays
// With the size as read; fs_sizes_end must follow, even where the photo fails.
int fs_sizes_begin(PhotoSizes *sizes, int width, int height, FsError *err);
// The next row from the top: rgb (width, 3), clipped (width) or NULL where none is.
void fs_sizes_row(PhotoSizes *sizes, const float *rgb, const float *clipped);
// The clipped pixels of a row, before it is handed over: of what is white all colours are clipped, and the white
// balance lifts red and blue above green, magenta. What is known is known up to `white`.
void fs_sizes_whiten(const PhotoSizes *sizes, float *rgb, const float *clipped);
void fs_sizes_end(PhotoSizes *sizes); // after the last row, or where the photo fails
void fs_sizes_free(PhotoSizes *sizes);

// Windows that end at edges: of the pixels around, those of like colour count (bilateral filter, Tomasi and Manduchi
// 1998; adaptive support weights, Yoon and Kweon 2006). What lies in the shade beside a bright edge is then not taken
// for a part of it. Colours are compared as roots of the light, so that likeness is about the same in the shade.
#ifndef FS_INITIALISE_EDGE_WINDOWS_H
#define FS_INITIALISE_EDGE_WINDOWS_H

#include "image/image.h"
#include "initialise/constants.h"

enum { EDGE_VALUES = 12, EDGE_SIDE = 2 * SWEEP_BLUR_RADIUS + 1 };

// One window a pixel.
typedef struct EdgeWindows {
    int width, height;
    float *weight; // (height, width, EDGE_SIDE, EDGE_SIDE), of each window's pixels; sum to 1, 0 beyond the border
} EdgeWindows;

// photo: linear rgb, NAN where not to be trusted; area-averaged to the grid.
int fs_edge_windows_new(const Image *photo, int width, int height, EdgeWindows *windows, FsError *err);
void fs_edge_windows_free(EdgeWindows *windows);
// values, sums: (height, width, EDGE_VALUES); the weighted sums over each pixel's window.
void fs_edge_windows_sum(const EdgeWindows *windows, const float *values, float *sums);

// Takes the mean over like pixels off a photo: fine (height, width, 4), r g b and 1 where trusted, else 0.
int fs_edge_windows_fine(const Image *photo, Image *fine, FsError *err);

#endif

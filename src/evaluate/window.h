// SSIM's Gaussian window (11x11, sigma 1.5) and the comparison of two planes under it, in double.
#pragma once

#include <stddef.h>

#define FS_WINDOW_SIZE 11
#define FS_WINDOW_RADIUS 5

// Doubles of scratch memory for planes of width x height.
size_t fs_window_scratch(int width, int height);

typedef struct WindowSums {
    double ssim;     // sum of luminance * contrast-structure over the pixels counted
    double contrast; // sum of contrast-structure alone
    double pixels;
} WindowSums;

// The image taken as 0 outside. margin: pixels left out at each border (0: all; FS_WINDOW_RADIUS: only whole windows).
WindowSums fs_window_compare(const double *a, const double *b, int width, int height, int margin, double *scratch);

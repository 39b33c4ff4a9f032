// What a photo's picture tells of how it was taken: measured at a small size, to be compared with other photos'.
#pragma once

#include "image/image.h"

#define FS_LOOK_EDGE 800 // pixels; the longer side that is looked at

enum { LOOK_DIRECTIONS = 4 };
typedef struct Look {
    double mean;                    // linear light
    double clipped;                 // share of the picture
    double detail[LOOK_DIRECTIONS]; // fine structure as a share of coarse, across, down and along the diagonals
} Look;

// rgb: linear, upright. clipped is the caller's.
int fs_look_at(Look *look, const Image *rgb, FsError *err);

// What a photo's picture tells of how it was taken: measured at a small size, to be compared with other photos'.
#pragma once

#include <stdint.h>

#include "image/image.h"

#define FS_LOOK_EDGE 800 // pixels; the longer side that is looked at
#define FS_LOOK_SMALL 96 // of Look.small

enum { LOOK_DIRECTIONS = 4 };
typedef struct Look {
    double mean;                    // linear light
    double clipped;                 // share of the picture
    bool grey;                      // without any colour
    double detail[LOOK_DIRECTIONS]; // fine structure as a share of coarse, across, down and along the diagonals
    Image small;                    // square root of the light, 1 channel; {0}: the picture is smaller than that
    uint64_t hash;                  // of the picture: equal ones are the same to the last bit; 0: as small
} Look;

// rgb: linear, upright. clipped is the caller's.
int fs_look_at(Look *look, const Image *rgb, FsError *err);
void fs_look_free(Look *look); // accepts {0}

// Features of one picture: places with 128-byte descriptors, as COLMAP finds them.
#pragma once

#include <stdint.h>

#define FS_DESCRIPTOR 128

typedef struct Features {
    int n;
    float *xy;           // (n, 2) pixels of the picture, centres at +0.5
    float *scale;        // (n) pixels
    float *angle;        // (n) radians
    int16_t *descriptor; // (n, 128) values 0..255; 16 bits so that products vectorise
} Features;

typedef struct Match {
    int a, b; // feature numbers in the first and second picture
} Match;

typedef struct MatchList {
    Match *match;
    int n;
} MatchList;

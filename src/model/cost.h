// What a run will take, said before it starts: each stage knows its own share (fs_<stage>_estimate), estimate.c adds
// up.
#pragma once

typedef struct RunSize {
    int photos, width, height; // of the working images
    double picture_pixels;     // of the pictures in which poses looks for features
} RunSize;

typedef struct RunCost {
    double seconds; // on this machine
    double bytes;   // at most, of the program
} RunCost;

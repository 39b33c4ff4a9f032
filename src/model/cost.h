// What a run will take, said before it starts: each stage knows its own share, estimate.c adds up.
#pragma once

#include "base/error.h"

typedef struct RunSize {
    int photos, width, height; // of the working images
    double picture_pixels;     // of the pictures in which poses looks for features
    int splats;                // of a cloud before training; 0: not known yet, as the settings say
} RunSize;

typedef struct RunCost {
    double seconds; // on this machine
    double bytes;   // at most, of the program
} RunCost;

// An error where this machine has not the memory for them.
int fs_cost_check(const RunSize *size, double bytes, FsError *err);

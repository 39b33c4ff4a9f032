// Regions of a small grid: cells that hang together, closed and filled.
#ifndef FS_TRAIN_REGION_H
#define FS_TRAIN_REGION_H

#include <stdbool.h>

enum { REGION_SIDE = 128 };

typedef struct Region {
    int width, height; // at most REGION_SIDE
    unsigned char in[REGION_SIDE * REGION_SIDE];
} Region;

// Of the cells (height, width) above the threshold, after a mean over 3 x 3: gaps of up to twice `gap` cells are
// closed, then those that hang together in fewer than `least` cells are left out, and those whose mean is not
// `stands_out` above that of what is around them (of cells above 0). What lies between two cells of another one in a
// row or in a column is filled; `one`: of all the others, which are parts of one figure, but for strips, more than
// three times as wide as high, that reach farther to a side than half the width of the largest beyond it.
typedef struct RegionRule {
    float threshold, stands_out;
    int gap, least;
    bool one;
} RegionRule;
// cells (height, width), of the size that is in `region`.
void fs_region_find(Region *region, const float *cells, const RegionRule *rule);
// Every column goes on down to so many widths below the top; upwards: up, above the bottom.
void fs_region_complete(Region *region, double height, bool upwards);
// How much stands out in REGION_SIDE x REGION_SIDE cells: the variance of the means of blocks, of the cells seen
// (others are 0), times their number. (That of single cells is mostly noise, of which there is more where more cells
// are seen.)
double fs_region_clarity(const float *cells, const bool *seen);
void fs_region_spread(Region *region, unsigned char value, int radius); // to cells that have one of it that near

#endif

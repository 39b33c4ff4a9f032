// Regions of a small grid: cells that hang together, closed and filled.
#ifndef FS_TRAIN_REGION_H
#define FS_TRAIN_REGION_H

#include <stdbool.h>

enum { REGION_SIDE = 128 };

typedef struct Region {
    int width, height; // at most REGION_SIDE
    unsigned char in[REGION_SIDE * REGION_SIDE];
} Region;

// Of the cells (height, width) above the threshold, after a mean over 3 x 3: gaps of up to twice `gap` cells and holes
// are filled, then those that hang together in fewer than `least` cells, or have none above `sure`, are left out.
typedef struct RegionRule {
    float threshold, sure;
    int gap, least;
} RegionRule;
void fs_region_find(Region *region, const float *cells, const RegionRule *rule);
// Where all that is in it is no higher than `upper` of its widths, every column goes on down to `height` widths.
void fs_region_complete(Region *region, double upper, double height);
void fs_region_spread(Region *region, unsigned char value, int radius); // to cells that have one of it that near

#endif

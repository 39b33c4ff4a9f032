// Scattered values in an image become a full image: averages where there are values, smoothly carried on elsewhere.
#ifndef FS_IMAGE_FILL_H
#define FS_IMAGE_FILL_H

#include <stddef.h>

#include "base/error.h"

// Push and pull over a pyramid. value (height, width, channels) holds sums of weight * value and becomes the image;
// weight (height, width) is how sure each pixel is of its value, 0: not at all, 1 and more: fully.
// *any: false when all weights are 0 (the image then means nothing).
int fs_fill_holes(float *value, const float *weight, int width, int height, int channels, bool *any, FsError *err);

// The same in room of so many floats that the caller has; returns `any`.
size_t fs_fill_room(int width, int height, int channels);
bool fs_fill_holes_in(float *room, float *value, const float *weight, int width, int height, int channels);

#endif

// A Gaussian over an image, mirrored at the edges. sigma: pixels, up to 5.
#pragma once

#include "image/image.h"

// scratch, out: of the image's size, and neither is the image's own.
void fs_blur_image(const Image *image, float *scratch, float *out, float sigma);

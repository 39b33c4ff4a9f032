// Pictures for people: one exposure for everything shown of a capture, and small display pictures of linear images.
// Numbers meant for programs never go through here; see image/tone.h.
#pragma once

#include "model/dataset.h"

// The exposure of the pleasant tone curve, from an even choice of the capture's photos.
int fs_preview_exposure(const char *out, const Dataset *dataset, float *exposure, FsError *err);
// A display picture of a linear image, averaged down to a longer side of long_edge pixels (0 or larger: as it is).
int fs_preview_picture(const Image *linear, int long_edge, float exposure, Image *picture, FsError *err);
// The same averaging alone.
int fs_preview_shrink(const Image *image, int long_edge, Image *smaller, FsError *err);
// Up to `most` views, spread evenly over the capture, flash and no-flash in turn; returns how many.
int fs_preview_choose(const Dataset *dataset, int most, int *chosen);

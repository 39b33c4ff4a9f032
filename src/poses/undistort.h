// A photo as an ideal pinhole camera would have taken it.
#pragma once

#include "image/image.h"
#include "model/lens.h"

// Resamples photo (3 channels, linear) and mask (1 channel) in place from the lens to the camera, both of their size.
// By Lanczos's kernel of three lobes where the neighbourhood is inside the photo; the mask is 0 where one of the
// four nearest pixels was 0, or outside the photo.
int fs_undistort(const Lens *lens, const Camera *camera, Image *photo, Image *mask, FsError *err);

// Masks that the user gives (fs_photos_mask): upright, of the photo's shape and size, or at least of the largest
// picture that ingest makes of it (2000 pixels, or the working image); black where the photo is not to be used.
#pragma once

#include "model/photos.h"

// Where not all of a pixel is white it is made black in `photo` and, unless that is NULL, 0 in `trusted`. mask:
// replaced by what was read, 0 or 1 in the photo's size; NULL: not wanted.
int fs_photo_mask_apply(const char *path, Image *photo, Image *trusted, Image *mask, FsError *err);
// A folder of masks must have one for some photo.
int fs_photo_mask_check(const Photos *photos, const Log *log, FsError *err);

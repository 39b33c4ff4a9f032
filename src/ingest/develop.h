// Photos to working images.
#pragma once

#include "model/photos.h"

#define FS_DEVELOP_FEATURES_EDGE 1600 // pixels; longer side of the pictures in which poses looks for features
// One photo to its working image and mask: writes <dir>/<name>.tif, <dir>/<name>_mask.png and
// <dir>/features/<name>.png, of a masked one <dir>/features_masks/<name>.png.png too; where the photo has more pixels
// than its working image, <dir>/fine/<name>.tif and <name>_mask.png, for a lens to be undone on. Fills the photo's
// sizes and figures, or its failure.
void fs_develop_photo(const Photos *photos, PhotoFile *photo, const char *dir, int long_edge);
// Bytes of the pictures that are made of it, at once.
double fs_develop_bytes(const PhotoFile *photo, int long_edge);

// One white balance and one exposure for the whole capture, by medians; warns where the photos differ.
int fs_level_photos(Photos *photos, const Log *log, FsError *err);

// One photo to its working image and mask.
#pragma once

#include "ingest/photos.h"

#define FS_FEATURES_LONG_EDGE 1600 // pixels; of the pictures in which poses looks for features

// Writes <dir>/<name>.tif, <dir>/<name>_mask.png and <dir>/features/<name>.png; fills the photo's sizes and figures, or
// its failure.
void fs_develop_photo(const Photos *photos, PhotoFile *photo, const char *dir, int long_edge);

// Which way is up, from how the photos were held: their sides lie level.
#pragma once

#include "model/dataset.h"

// up: of length 1, in the world. As far as all photos look the same way it is their own upright; photos that are stored
// on their side count by their other sides.
void fs_vertical_find(const View *const *views, int n, double up[3]);
// The photo's side that points down, of length 1.
void fs_vertical_lower(const Camera *camera, const double up[3], double lower[3]);

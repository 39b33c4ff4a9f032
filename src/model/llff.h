// Poses as LLFF has them, poses_bounds.npy: a row a photo, in the order of the photos' names, of 15 pose values
// (3 x 5: camera-to-world axes down, right, backward; place; height, width, focal length in pixels) and two depths.
#pragma once

#include "model/cameras_file.h"

// The photos are those of the folder images (or images_*, as many as there are rows) beside the file.
int fs_llff_read(const char *path, PosedView **view, int *n, FsError *err); // view: the caller's, names too

// The stage poses: where every photo was taken from, photos without lens distortion, and points in space.
#pragma once

#include "model/cost.h"
#include "model/project.h"

// Of a picture, in which features are looked for.
double fs_poses_pixels(const FsProject *project, const RunSize *size);
int fs_poses_run(FsProject *project, FsError *err);

// The stage poses: where every photo was taken from, photos without lens distortion, and points in space.
#pragma once

#include "model/cost.h"
#include "model/project.h"

// Of a picture, in which features are looked for.
double fs_poses_pixels(const FsProject *project, const RunSize *size);
// Before a run: whether COLMAP is there, where poses are not done and no model is named.
int fs_poses_check(const FsProject *project, FsError *err);
int fs_poses_run(FsProject *project, FsError *err);

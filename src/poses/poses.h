// The stage poses: where every photo was taken from, photos without lens distortion, and points in space.
#pragma once

#include "model/project.h"

int fs_poses_run(FsProject *project, FsError *err);

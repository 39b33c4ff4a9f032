// The stage poses: where every photo was taken from, photos without lens distortion, and points in space.
#ifndef FS_POSES_POSES_H
#define FS_POSES_POSES_H

#include "model/project.h"

int fs_poses_run(FsProject *project, FsError *err);

#endif

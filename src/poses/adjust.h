// Poses, focal lengths and distortion once more by least squares over the triangulated points, whose tracks are longer
// and whose features are finer than those the poses were found with.
#ifndef FS_POSES_ADJUST_H
#define FS_POSES_ADJUST_H

#include "poses/colmap.h"
#include "poses/sparse.h"

// Replaces the poses and lenses; the points are left as they were. Keeps everything when it cannot be done.
int fs_adjust_poses(Colmap *colmap, Sparse *sparse, FsError *err);

#endif

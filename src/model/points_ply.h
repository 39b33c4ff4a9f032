// Points out of a PLY of any maker, a dense cloud of COLMAP's (fused.ply) say: text or binary of either byte order, x,
// y and z of any type of number among whatever other properties; what follows the vertices is not read.
#pragma once

#include "base/error.h"

int fs_points_ply_read(const char *path, float **xyz, int *n, FsError *err); // xyz (n, 3), the caller's; finite ones

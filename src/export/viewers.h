// The clouds' files that the usual viewers open. srgb: (N, 3) display values 0..1.
#pragma once

#include <math.h>

#include "model/cloud.h"

// PLY in the property order of the INRIA 3D Gaussian Splatting program, spherical harmonics of degree 0.
int fs_inria_write(const Cloud *cloud, const float *srgb, const char *path, FsError *err);
// The ".splat" format of web viewers: 32 bytes a Gaussian, the most visible first.
int fs_splat_write(const Cloud *cloud, const float *srgb, const char *path, FsError *err);

// Unit quaternions for viewers that do not normalise them themselves.
static inline void fs_rotation_unit(const float quat_wxyz[4], float unit[4])
{
    double n = 0;
    for (int k = 0; k < 4; k++) n += (double)quat_wxyz[k] * (double)quat_wxyz[k];
    for (int k = 0; k < 4; k++) unit[k] = n > 0 ? (float)(quat_wxyz[k] / sqrt(n)) : (k == 0 ? 1.0f : 0.0f);
}

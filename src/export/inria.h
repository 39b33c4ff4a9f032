// PLY in the property order of the INRIA 3D Gaussian Splatting program, spherical harmonics of degree 0.
#ifndef FS_EXPORT_INRIA_H
#define FS_EXPORT_INRIA_H

#include "model/cloud.h"

// srgb: (N, 3) display values 0..1.
int fs_inria_write(const Cloud *cloud, const float *srgb, const char *path, FsError *err);

#endif

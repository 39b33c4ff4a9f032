// The ".splat" format of web viewers: 32 bytes a Gaussian, the most visible first.
#ifndef FS_EXPORT_SPLAT_H
#define FS_EXPORT_SPLAT_H

#include "model/cloud.h"

// srgb: (N, 3) display values 0..1.
int fs_splat_write(const Cloud *cloud, const float *srgb, const char *path, FsError *err);

#endif

// Unit quaternions for viewers that do not normalise them themselves.
#ifndef FS_EXPORT_ROTATION_H
#define FS_EXPORT_ROTATION_H

#include <math.h>

static inline void fs_rotation_unit(const float quat_wxyz[4], float unit[4])
{
    double n = 0;
    for (int k = 0; k < 4; k++) n += (double)quat_wxyz[k] * (double)quat_wxyz[k];
    for (int k = 0; k < 4; k++) unit[k] = n > 0 ? (float)(quat_wxyz[k] / sqrt(n)) : (k == 0 ? 1.0f : 0.0f);
}

#endif

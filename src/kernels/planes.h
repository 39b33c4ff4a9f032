// Images of a training step: (channels, height, stride) floats, stride a multiple of 16 and >= width, 64-byte aligned.
// The padding columns may hold any finite value and never count. Work is cut into strips of rows: a kernel call
// handles rows [y0, y1) and returns its part of a sum in double; the caller adds the parts in strip order, so that
// results do not depend on the number of threads.
#ifndef FS_KERNELS_PLANES_H
#define FS_KERNELS_PLANES_H

#include <stddef.h>
#include <string.h>

typedef struct Planes {
    int width, height, channels, stride;
    float *px; // channel c, row y starts at px + (c * height + y) * stride
} Planes;

static inline float *fs_planes_row(const Planes *p, int channel, int y)
{
    return p->px + ((size_t)channel * (size_t)p->height + (size_t)y) * (size_t)p->stride;
}

static inline void fs_planes_zero(const Planes *p, int y0, int y1) // rows [y0, y1)
{
    for (int c = 0; c < p->channels; c++)
        memset(fs_planes_row(p, c, y0), 0, sizeof(float) * (size_t)p->stride * (size_t)(y1 - y0));
}

static inline int fs_planes_stride(int width)
{
    return (width + 15) / 16 * 16;
}

static inline size_t fs_planes_floats(int width, int height, int channels) // that the planes take
{
    return (size_t)channels * (size_t)height * (size_t)fs_planes_stride(width);
}

// Planes in memory of the caller's: fs_planes_floats floats, 64-byte aligned.
static inline Planes fs_planes_over(float *px, int width, int height, int channels)
{
    return (Planes){width, height, channels, fs_planes_stride(width), px};
}

#endif

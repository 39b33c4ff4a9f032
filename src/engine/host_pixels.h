// The pixels of a photo that a step looks at: all of them, or every so many-th of every so many-th row, beginning
// anywhere. Those are a photo too, of a camera with fewer pixels that has not averaged anything.
#ifndef FS_ENGINE_HOST_PIXELS_H
#define FS_ENGINE_HOST_PIXELS_H

#include "base/rng.h"
#include "engine/host_engine.h"

typedef struct HostPixels {
    int stride[2];                // columns, rows; 1: all of them
    Camera camera;                // that takes just these
    Planes photo, trust, mu, var; // the view's planes at these: the view's own where all are looked at
    bool windows;                 // mu and var are to be made (fs_host_pixels_windows)
} HostPixels;

// Planes come from the arena (check arena->failed). windows: mu and var are wanted.
void fs_host_pixels_pick(HostPixels *pixels, Arena *arena, const HostView *view, const int stride[2], bool windows,
                         Rng *rng);
// Makes rows [y0, y1) of mu and var, where they are not the view's own. scratch: fs_photometric_scratch bytes.
void fs_host_pixels_windows(const HostPixels *pixels, const Kernels *kernels, int y0, int y1, void *scratch);

#endif

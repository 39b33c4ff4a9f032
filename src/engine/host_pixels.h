// The pixels of a photo that a step looks at: all of them, or every so many-th of every so many-th row, beginning
// anywhere. Those are a photo too, of a camera with fewer pixels that has not averaged anything.
#ifndef FS_ENGINE_HOST_PIXELS_H
#define FS_ENGINE_HOST_PIXELS_H

#include "base/rng.h"
#include "engine/host_engine.h"

typedef struct HostPixels {
    int stride[2];       // columns, rows; 1: all of them
    Camera camera;       // that takes just these
    Planes photo, trust; // the view's planes at these: the view's own where all are looked at
    Planes mu, var;      // of the windows in photo (kernels/photometric.h)
} HostPixels;

// Planes come from the arena (check arena->failed); mu and var are to be filled.
void fs_host_pixels_pick(HostPixels *pixels, Arena *arena, const HostView *view, const int stride[2], Rng *rng);

#endif

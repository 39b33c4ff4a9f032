// Planes of a view's size in an arena.
#ifndef FS_ENGINE_SCRATCH_H
#define FS_ENGINE_SCRATCH_H

#include "base/arena.h"
#include "kernels/planes.h"
#include "model/camera.h"

static inline Planes fs_scratch_planes(Arena *arena, const Camera *camera, int channels) // not cleared
{
    size_t floats = fs_planes_floats(camera->width, camera->height, channels);
    return fs_planes_over(ARENA_NEW(arena, float, floats), camera->width, camera->height, channels);
}

#endif

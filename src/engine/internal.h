// What the engine's own files and the training step share.
#ifndef FS_ENGINE_INTERNAL_H
#define FS_ENGINE_INTERNAL_H

#include "engine/engine.h"
#include "engine/pane.h"
#include "engine/raster_task.h"

#define FS_ENGINE_NEAR 0.1 // near plane, in scene extents

struct Engine {
    Kernels kernels;
    Threads *threads;
    RasterTask task[LAYERS];
    RasterTask lit_R; // rendering only: R in a flash photo
    Arena arena;      // planes of the present view
};

Planes fs_engine_planes(Engine *engine, const Camera *camera, int channels); // from the arena, not cleared
ShadeLight fs_engine_light(const Scene *scene, const Camera *camera);        // the flash at a camera, on T
ShadeLight fs_engine_return(const Scene *scene, const Camera *camera);       // what of it comes back by the room, on R
void fs_engine_sigmoid(const Planes *logit, const Planes *out, int y0, int y1);

#endif

// The engine of the devices that compute in host memory: "cpu" and "reference". They differ in the rasteriser, the
// kernels, the threads and the strips that images are cut into; see host_engine.c for their tables.
#ifndef FS_ENGINE_HOST_ENGINE_H
#define FS_ENGINE_HOST_ENGINE_H

#include <math.h>

#include "engine/device.h"
#include "engine/raster_volumes.h"
#include "engine/view_images.h"

typedef struct HostView {
    Camera camera;
    bool flash;
    Planes photo; // (3, h, w) tone-mapped
    Planes mask;  // (1, h, w)
    PhotoState state;
    float flash_gain, exposure_gain;
    float *memory;                        // of all the planes
    OcclusionState *occlusion;            // NULL: nobody
    unsigned char lamps[OCCLUSION_CELLS]; // EngineView.lamps
} HostView;

enum { TASK_T, TASK_R, TASK_BETA, TASK_OTHER_T, TASK_LIT_R, HOST_TASKS };

typedef struct HostEngine {
    Engine base;
    Kernels kernels;
    Threads *threads; // NULL: none but the caller's
    const Rasteriser *raster;
    int strip; // rows per job; 0: whole images
    Scene scene;
    TrainState state;
    GainGraph graph;     // start NULL: none
    VolumesWork volumes; // of scene.field
    HostView *views;     // (base.n_views)
    RasterTask task[HOST_TASKS];
    Arena arena; // of one step or render
} HostEngine;

static inline HostEngine *fs_host_engine(Engine *engine)
{
    return (HostEngine *)engine;
}
// Factor on alpha, of T or R (PHOTO_T, PHOTO_R), whose own factor is on all of its light.
static inline float fs_host_engine_flash(const HostView *view, int of)
{
    return view->flash_gain * expf(view->state.x[PHOTO_FLASH] - view->state.x[of]);
}
static inline float fs_host_engine_veil_light(const HostView *view) // factor on the flash's light
{
    return view->flash ? view->flash_gain * expf(view->state.x[PHOTO_FLASH]) : 0;
}
static inline int fs_host_engine_strips(const HostEngine *engine, int height)
{
    return engine->strip ? (height + engine->strip - 1) / engine->strip : 1;
}
static inline int fs_host_engine_strip_end(const HostEngine *engine, int strip, int height)
{
    return engine->strip && (strip + 1) * engine->strip < height ? (strip + 1) * engine->strip : height;
}

static inline const Rasteriser *fs_host_engine_raster(const HostEngine *engine)
{
    return fs_radiance_is(&engine->scene.field) ? &fs_raster_volumes : engine->raster;
}

// Sets a task up for a part of a view; see RasterTask for the rest of its inputs.
RasterTask *fs_host_engine_task(HostEngine *engine, int task, const PlanPart *part);

int fs_host_engine_need_state(HostEngine *engine, FsError *err); // makes what training keeps, where it is not there yet

// gain_graph.c
int fs_gain_graph_make(GainGraph *graph, const int *neighbour, int n, FsError *err); // neighbour (n, ENGINE_NEIGHBOURS)
void fs_gain_graph_free(GainGraph *graph);
// host_render.c, host_step.c
int fs_host_render(Engine *engine, const Camera *camera, Renders *renders, FsError *err);
int fs_host_step(Engine *engine, const StepArgs *args, StepResult *result, FsError *err);

#endif

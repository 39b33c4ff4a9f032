// What a device offers: one table. engine.c has checked all arguments before it calls one of these; see engine.h for
// what they mean.
#ifndef FS_ENGINE_DEVICE_H
#define FS_ENGINE_DEVICE_H

#include "engine/engine.h"

typedef struct EngineDevice {
    const char *name; // as the setting "device" says it
    int (*open)(Engine **engine, const char *cpu, int threads, FsError *err);
    void (*close)(Engine *engine);
    int (*scene_up)(Engine *engine, const Scene *scene, FsError *err);
    int (*scene_down)(Engine *engine, unsigned layers, Scene *scene, FsError *err);
    int (*state_up)(Engine *engine, const TrainState *state, FsError *err);
    int (*state_down)(Engine *engine, TrainState *state, FsError *err);
    int (*edit)(Engine *engine, const CloudEdit *edit, FsError *err);
    int (*neighbours)(Engine *engine, const int *neighbour, FsError *err);
    int (*load_view)(Engine *engine, const EngineView *view, FsError *err);
    int (*photos_down)(Engine *engine, PhotoState *states, FsError *err);
    int (*occlusion_up)(Engine *engine, int view, const OcclusionState *state, FsError *err);
    int (*occlusion_down)(Engine *engine, int view, OcclusionState *state, FsError *err);
    void (*drop_views)(Engine *engine);
    int (*render)(Engine *engine, const Camera *camera, Renders *renders, FsError *err);
    int (*step)(Engine *engine, const StepArgs *args, StepResult *result, FsError *err);
} EngineDevice;

extern const EngineDevice fs_device_cpu;       // tiles, SIMD, threads
extern const EngineDevice fs_device_reference; // the scalar definition on one thread: what the others are held against

// Every device's engine begins with this; engine.c keeps it.
struct Engine {
    const EngineDevice *device;
    bool up;                         // there is a scene
    int n[LAYERS];                   // its Gaussians
    int width[LAYERS][CLOUD_FIELDS]; // of their fields
    bool fields;                     // it is of radiance fields
    bool veil;                       // it has one
    int n_views;
};

#endif

// What training and rendering compute with: renders a scene's layers at a camera.
#ifndef FS_ENGINE_ENGINE_H
#define FS_ENGINE_ENGINE_H

#include "image/image.h"
#include "model/camera.h"
#include "model/scene.h"

typedef struct Engine Engine;

// cpu: the setting "cpu". threads: the setting "threads".
int fs_engine_new(Engine **engine, const char *cpu, int threads, FsError *err);
void fs_engine_free(Engine *engine);

typedef enum RenderLayer {
    RENDER_T_N,
    RENDER_T_F,
    RENDER_R,       // beta * R_scene: the reflected contribution as seen in the photo
    RENDER_R_SCENE, // before beta
    RENDER_BETA,
    RENDER_I_N, // composites
    RENDER_I_F,
    RENDER_DEPTH_T, // z, world units, divided by the accumulated alpha; 0 where alpha is under a half
    RENDER_DEPTH_R,
    RENDER_LAYERS
} RenderLayer;

typedef struct RenderLayerInfo {
    const char *name; // of the folder on disk: "T_N", "R_scene", "depth_T", ...
    int channels;     // 3, or 1 for beta and depth
    bool depth;
} RenderLayerInfo;
extern const RenderLayerInfo fs_render_layers[RENDER_LAYERS];

// Renders all layers, in linear light, each (camera height, camera width, channels). The images are the caller's
// (fs_renders_free); they are reused when they have the right size.
typedef struct Renders {
    Image layer[RENDER_LAYERS];
} Renders;
int fs_engine_render(Engine *engine, const Scene *scene, const Camera *camera, Renders *renders, FsError *err);
void fs_renders_free(Renders *renders);

#endif

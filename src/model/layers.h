// The layers by name, in two tables: the four of the image model I = T + beta * R (Flash-Splat, section 3), which have
// Gaussians, and those that are rendered, measured and shown, each a folder of its name on disk. The model's R is the
// mirrored room itself: the render R_scene; the render R is beta * R, as the photo shows it.
#pragma once

#include <stdbool.h>

typedef enum Layer { LAYER_T_F, LAYER_T_N, LAYER_R, LAYER_BETA, LAYERS } Layer;

typedef struct LayerInfo {
    const char *name; // "T_F"
    int channels;
} LayerInfo;
extern const LayerInfo fs_layers[LAYERS];

typedef enum RenderLayer {
    RENDER_T_N,
    RENDER_T_F,
    RENDER_R,       // beta * R_scene: the reflected contribution as seen in the photo
    RENDER_R_SCENE, // before beta
    RENDER_BETA,
    RENDER_I_N, // composites
    RENDER_I_F,
    RENDER_DEPTH_T, // z, world units, where half of the light is stopped; 0 where less is
    RENDER_DEPTH_R,
    RENDER_LAYERS
} RenderLayer;

typedef struct RenderLayerInfo {
    const char *name; // of the folder on disk: "T_N", "R_scene", "depth_T", ...
    int channels;     // 3, or 1 for beta and depth
    bool depth;
} RenderLayerInfo;
extern const RenderLayerInfo fs_render_layers[RENDER_LAYERS];

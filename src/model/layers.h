// The four layers of the image model I = T + beta * R (Flash-Splat, section 3), as rows of one table. The model's R is
// the mirrored room itself: the render R_scene; the render R is beta * R, as the photo shows it (engine.h).
#ifndef FS_MODEL_LAYERS_H
#define FS_MODEL_LAYERS_H

typedef enum Layer { LAYER_T_F, LAYER_T_N, LAYER_R, LAYER_BETA, LAYERS } Layer;
typedef enum LayerLight { LIT_BY_FLASH = 1, LIT_BY_AMBIENT = 2, LIT_BY_BOTH = 3 } LayerLight; // photos it appears in

typedef struct LayerInfo {
    const char *name; // "T_F"
    LayerLight light;
    int channels;
} LayerInfo;
extern const LayerInfo fs_layers[LAYERS];

#endif

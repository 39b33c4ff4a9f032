#include "model/layers.h"

const LayerInfo fs_layers[LAYERS] = {
    [LAYER_T_F] = {"T_F", 3},
    [LAYER_T_N] = {"T_N", 3},
    [LAYER_R] = {"R", 3},
    [LAYER_BETA] = {"beta", 1},
};

const RenderLayerInfo fs_render_layers[RENDER_LAYERS] = {
    [RENDER_T_N] = {"T_N", 3, false},
    [RENDER_T_F] = {"T_F", 3, false},
    [RENDER_R] = {"R", 3, false},
    [RENDER_R_SCENE] = {"R_scene", 3, false},
    [RENDER_BETA] = {"beta", 1, false},
    [RENDER_I_N] = {"I_N", 3, false},
    [RENDER_I_F] = {"I_F", 3, false},
    [RENDER_DEPTH_T] = {"depth_T", 1, true},
    [RENDER_DEPTH_R] = {"depth_R", 1, true},
};

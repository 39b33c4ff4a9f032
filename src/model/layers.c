#include "model/layers.h"

const LayerInfo fs_layers[LAYERS] = {
    [LAYER_T_F] = {"T_F", LIT_BY_FLASH, 3},
    [LAYER_T_N] = {"T_N", LIT_BY_AMBIENT, 3},
    [LAYER_R] = {"R", LIT_BY_BOTH, 3},
    [LAYER_BETA] = {"beta", LIT_BY_BOTH, 1},
};

// Colour textures with a mip chain, sampled in linear light.
#pragma once

#include <stdint.h>

#include "synth/canvas.h"

#define TEXTURE_LEVELS 12

typedef struct Texture {
    int levels;
    int width[TEXTURE_LEVELS], height[TEXTURE_LEVELS];
    uint8_t *texel[TEXTURE_LEVELS]; // (height, width, 4) sRGB-coded, fourth byte unused
    Vec mean;                       // linear
} Texture;

int fs_texture_new(Texture *texture, const Canvas *canvas); // negative: out of memory
void fs_texture_free(Texture *texture);
// Linear colour at (u, v), repeating, v upwards; spread: width of the looked-up area in texels of level 0.
Vec fs_texture_sample(const Texture *texture, float u, float v, float spread);
const float *fs_texture_linear(void); // (256) of sRGB-coded bytes

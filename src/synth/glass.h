// The pane: what it mirrors and lets through, and the dirt on it.
#pragma once

#include <stdint.h>

#include "synth/layout.h"

typedef struct GlassShare {
    float front, rear; // mirrored by the pane, and by a second one behind it as seen through the first
    float through;
} GlassShare;

// By Fresnel's equations for light that is not polarised, of both faces of a sheet: 2 r / (1 + r). cosine: of the angle
// to the normal.
GlassShare fs_glass_share(const Layout *layout, float refraction, float cosine);
float fs_glass_refraction(const Layout *layout, float f0); // index at which f0 of the light is mirrored head-on
// How much of the pane dirt covers at a place of it (metres), as a share of the mean.
float fs_glass_dirt(uint32_t seed, float u, float v);

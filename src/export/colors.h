// Colours of a scene's Gaussians as a viewer shows them: sRGB display values out of tone-mapped camera RGB.
#pragma once

#include <stdbool.h>

#include "model/scene.h"

// The one development of a scene, the same for all its layers.
typedef struct Development {
    float exposure;             // multiplies linear light, before the shoulder and the sRGB curve
    bool has_matrix;            // the capture says what its camera RGB means
    double srgb_from_camera[9]; // (3, 3) row-major, linear
    bool has_eye;
    double eye[3]; // mean centre of the photos' cameras: where a pane's beta is taken from, and where the flash is
    bool room;     // R is the mirrored room itself, before the pane dims it
} Development;

// The cloud a layer is shown by (T_F of shared geometry: T_N's, where the flash makes a difference); NULL when
// the scene has none for it.
const Cloud *fs_colors_cloud(const Scene *scene, Layer layer);
// Linear camera RGB (N, 3) of that cloud, as the layer is seen in a photo (beta: the reflectance, grey).
void fs_colors_linear(const Scene *scene, Layer layer, const Development *development, float *linear);
// Linear camera RGB to display values 0..1.
void fs_colors_develop(const Development *development, float color[3]);
// Display values 0..1 (N, 3) of a layer's cloud.
void fs_colors_display(const Scene *scene, Layer layer, const Development *development, float *srgb);

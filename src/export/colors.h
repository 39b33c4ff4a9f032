// Colours of a scene's Gaussians as a viewer shows them: sRGB display values out of tone-mapped camera RGB.
#pragma once

#include <stdbool.h>

#include "model/preview.h"
#include "model/project.h"
#include "model/scene.h"

// The one development of a scene, the same for all its layers.
typedef struct Development {
    PreviewLight light;
    bool has_eye;
    double eye[3]; // mean centre of the photos' cameras: where a pane's beta is taken from, and where the flash is
    bool room;     // R is the mirrored room itself, before the pane dims it
} Development;

// What is exported of a scene as a whole, borrowed.
typedef struct ExportArgs {
    const FsProject *project;
    const Scene *scene;
    const Dataset *photos;
    const Development *development;
} ExportArgs;

// The cloud a layer is shown by (T_F of shared geometry: T_N's, where the flash makes a difference); NULL when
// the scene has none for it.
const Cloud *fs_colors_cloud(const Scene *scene, Layer layer);
// Linear camera RGB (N, 3) of that cloud, as the layer is seen in a photo (beta: the reflectance, grey).
void fs_colors_linear(const Scene *scene, Layer layer, const Development *development, float *linear);
// Display values 0..1 (N, 3) of a layer's cloud.
void fs_colors_display(const Scene *scene, Layer layer, const Development *development, float *srgb);

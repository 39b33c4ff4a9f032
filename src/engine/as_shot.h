// Renders as the camera of a photo would have shown them: with the light of dirt on the pane, the vignetting, the
// response, the exposure and the white balance that training learned (kernels/veil.h, kernels/calibration.h).
#pragma once

#include "engine/engine.h"
#include "model/dataset.h"

typedef struct AsShot {
    const Scene *scene;
    struct json_t *photos; // fs_scene_photos
} AsShot;

int fs_as_shot_open(AsShot *as_shot, const Scene *scene, const char *out, FsError *err);
void fs_as_shot_close(AsShot *as_shot);
// Linear light, in place; what is not known of the view's photo is left as it is.
int fs_as_shot_apply(const AsShot *as_shot, const View *view, Image *composite, FsError *err);
// layers: what the photo shows of the transmitted scene, and in all, by the renders at its pose: with the light of that
// photo too. camera: of the renders; it may see more than the view's, and at another size. Linear light.
int fs_as_shot_layers(const AsShot *as_shot, const View *view, const Camera *camera, const Renders *renders,
                      Image layers[2], FsError *err);
// The same by what is known of the photo in training.
int fs_as_shot_layers_of(const Scene *scene, const PhotoState *state, const View *view, const Camera *camera,
                         const Renders *renders, Image layers[2], FsError *err);

// A composite as the camera of a photo would have shown it: with the vignetting, the response, the exposure and the
// white balance that training learned (kernels/calibration.h), to compare with the photo.
#pragma once

#include "model/dataset.h"
#include "model/scene.h"

typedef struct AsShot {
    const Scene *scene;
    void *photos; // OUT/clouds/photos.json, or NULL
} AsShot;

void fs_as_shot_open(AsShot *as_shot, const Scene *scene, const char *out);
void fs_as_shot_close(AsShot *as_shot);
// Linear light, in place; what is not known of the view's photo is left as it is.
int fs_as_shot_apply(const AsShot *as_shot, const View *view, Image *composite, FsError *err);

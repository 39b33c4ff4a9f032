// The hand-held path: where each photo and each held-out view is taken from.
#pragma once

#include "model/camera.h"
#include "synth/layout.h"

typedef struct Shot {
    char name[16]; // IMG_0001, TEST_01
    bool flash, held_out, truth;
    Camera camera;
} Shot;

// spec->photos then spec->held_out shots; negative: out of memory. The caller frees *shots.
int fs_path_plan(const Layout *layout, const Spec *spec, Shot **shots, FsError *err);
// The error that structure-from-motion usually leaves in a pose.
Camera fs_path_disturbed(const Camera *camera, Rng *rng);

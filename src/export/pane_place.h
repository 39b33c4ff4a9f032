// Where the pane is. Training learns which way it faces; how far away it is shows in no photo. But all that is seen in
// or through it lies behind it, so it is taken to be as far as the nearest of that.
#pragma once

#include "model/dataset.h"
#include "model/scene.h"

typedef struct PanePlace {
    double normal[3], distance; // normal . x = distance, away from the photos
    float corner[4][3];         // of the rectangle that the photos look through, in their order around it
    bool has_corners;           // false: no posed photos
} PanePlace;

// given: distance from the middle of the photos' places, in units of the poses; 0: to be found. An error where the
// scene has no pane.
int fs_pane_place_find(const Scene *scene, const Dataset *photos, double given, PanePlace *place, FsError *err);

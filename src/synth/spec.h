// What a capture is asked to be: the settings, with the difficulties spelt out as numbers.
#pragma once

#include "base/error.h"
#include "model/settings.h"
#include "synth/field.h"

typedef struct Spec {
    unsigned seed;
    int photos, held_out, width, height;
    float alpha;         // mean gain of the flash on the transmitted scene
    float reflection;    // the mirrored layer's share of a no-flash photo's light
    float flash_return;  // mean R with flash / R without, minus 1
    float f0;            // reflectance of the pane at normal incidence
    float texture_keep;  // 0..1: share of the rich textures behind the pane
    float depth_stretch; // scales the depth of the transmitted scene
    float room_size;     // scales the mirrored room
    float shade;         // 0..1: how much of the light that fills shadows is missing behind the pane
    float black;         // share of the materials that are dark, in both scenes
    float path_scale;    // scales the path
    float turn;          // scales how obliquely one looks at the pane
    float follow;        // how far the aim moves with the camera: 0 stays, 1 as far
    bool picture;        // nothing but flat pictures close behind the pane
    bool frame;          // the pane's frame is in view
    bool lit;            // lamps and a screen behind the pane
    Field field;         // what is wrong with the photos
    bool pose_noise;     // truth/sparse carries the usual error of structure-from-motion
} Spec;

// FS_ERR_USAGE where `hard` or `field` name what there is not, or the photos would be too large.
int fs_spec_read(Spec *spec, const FsSettings *settings, FsError *err);

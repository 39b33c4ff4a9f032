// The first clouds of every layer, from the classified points.
#ifndef FS_INITIALISE_FIRST_SCENE_H
#define FS_INITIALISE_FIRST_SCENE_H

#include "initialise/dense.h"
#include "initialise/light.h"
#include "model/scene.h"
#include "model/settings.h"

typedef struct Material { // borrowed
    int n;
    const float *xyz; // (n, 3)
    const Cue *cue;
    const unsigned char *kind;
    const DensePoints *dense[2]; // transmitted, reflected: more points, without cues
} Material;

int fs_first_scene_make(const Frames *frames, const Material *points, const FlashLight *light, const Settings *set,
                        Threads *threads, Scene *scene, FsError *err);

#endif

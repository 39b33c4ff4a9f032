// The first clouds of every layer, from the classified points.
#ifndef FS_INITIALISE_FIRST_SCENE_H
#define FS_INITIALISE_FIRST_SCENE_H

#include "initialise/colored_seeds.h"
#include "model/scene.h"
#include "model/settings.h"

int fs_first_scene_make(const Frames *frames, const Material *points, const FlashLight *light, const Settings *set,
                        Threads *threads, Scene *scene, FsError *err);

#endif

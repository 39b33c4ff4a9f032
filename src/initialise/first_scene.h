// The first clouds of every layer, from the classified points.
#ifndef FS_INITIALISE_FIRST_SCENE_H
#define FS_INITIALISE_FIRST_SCENE_H

#include "initialise/start.h"
#include "model/scene.h"
#include "model/settings.h"

int fs_first_scene_make(const Start *start, const Settings *set, Scene *scene, FsError *err);

#endif

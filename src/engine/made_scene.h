// A scene that nobody took, for what times steps of training: the same numbers whenever it is made.
#pragma once

#include "engine/engine.h"

Scene fs_made_scene(void);                          // T with gains, and a pane; its clouds are to be made
Camera fs_made_scene_camera(int width, int height); // that has the clouds before it
void fs_made_scene_fill(Cloud *cloud, double size); // Gaussians of about this size, as deep and faint as a scene's
// Photos to train on, number 0 without the flash, 1 with it.
int fs_made_scene_load(Engine *engine, const Camera *camera, FsError *err);

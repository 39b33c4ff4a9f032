// The ambient light on every surface, once per scene.
#ifndef FS_SYNTH_BAKE_H
#define FS_SYNTH_BAKE_H

#include "base/threads.h"
#include "synth/world.h"

int fs_bake_ambient(World *world, Threads *threads, FsError *err); // after fs_world_finish
#endif

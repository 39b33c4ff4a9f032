// Both scenes as seeds with colours: from the points of each kind, by the flash's light on them.
#ifndef FS_INITIALISE_COLORED_SEEDS_H
#define FS_INITIALISE_COLORED_SEEDS_H

#include "initialise/first_colors.h"
#include "initialise/start.h"

int fs_colored_seeds_make(const Start *start, int count, ColoredSeeds *seeds, FsError *err);
void fs_colored_seeds_free(ColoredSeeds *colored);

#endif

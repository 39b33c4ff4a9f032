// The start of training: which points are seen through the pane and which are mirrored in it, told apart by what the
// flash does to them; and from those the first clouds of every layer.
#ifndef FS_INITIALISE_INITIALISE_H
#define FS_INITIALISE_INITIALISE_H

#include "model/project.h"

// Reads OUT/views.json, OUT/images and OUT/sparse; writes OUT/start.
int fs_initialise_run(FsProject *project, FsError *err);
// Whether the settings go together; so that it is said before photos are posed.
int fs_initialise_check(const Settings *set, FsError *err);
// Whether it looks for surfaces by stereo, which then is nearly all that it takes.
bool fs_initialise_looks(const Settings *set);

#endif

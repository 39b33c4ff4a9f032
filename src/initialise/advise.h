// Tells the user, before hours of training, when the capture's flash cue looks too weak for the method.
#ifndef FS_INITIALISE_ADVISE_H
#define FS_INITIALISE_ADVISE_H

#include "base/log.h"
#include "initialise/light.h"

void fs_advise(const SmallViews *views, const SparsePoints *points, const FlashLight *light, const Log *log);

#endif

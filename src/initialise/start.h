// What the parts of the stage hand on to each other; all of it borrowed.
#ifndef FS_INITIALISE_START_H
#define FS_INITIALISE_START_H

#include "base/log.h"
#include "initialise/classify.h"
#include "initialise/light.h"

typedef struct Start {
    const SmallViews *views;
    const SparsePoints *points; // classified
    const PointList *dense[2];  // transmitted, reflected: more points, without cues
    const DepthOdds *odds;
    const FlashLight *light;
    uint64_t seed;
    Threads *threads;
    const Log *log;
} Start;

#endif

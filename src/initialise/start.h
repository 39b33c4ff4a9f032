// The parts of the stage, and what they hand on to each other; all of that borrowed.
#ifndef FS_INITIALISE_START_H
#define FS_INITIALISE_START_H

#include "base/log.h"
#include "initialise/classify.h"
#include "initialise/first_colors.h"
#include "initialise/light.h"
#include "model/scene.h"
#include "model/settings.h"

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

// Dense points of both scenes: stereo on the photos tells both scenes' surfaces roughly; with colours, each is
// subtracted from the photos, and the other one is looked for again in what is left.
// start->dense is not read. dense[2]: transmitted, reflected; they may come out empty.
int fs_residual_stereo_find(const Start *start, PointList dense[2], FsError *err);
// Both scenes as seeds with colours: from the points of each kind, by the flash's light on them; or, not parted, in the
// photos' own colours.
int fs_colored_seeds_make(const Start *start, int count, bool parted, ColoredSeeds *seeds, FsError *err);
void fs_colored_seeds_free(ColoredSeeds *colored);
// The first clouds of every layer, from the classified points.
int fs_first_scene_make(const Start *start, const Settings *set, Scene *scene, FsError *err);
// Radiance fields, which begin as fog all over: a frame that holds what the photos see.
int fs_first_field_make(const Start *start, const Settings *set, Scene *scene, FsError *err);
// Tells the user, before hours of training, when the capture's flash cue looks too weak for the method.
void fs_advise(const SmallViews *views, const SparsePoints *points, const FlashLight *light, const Log *log);

#endif

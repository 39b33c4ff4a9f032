// Dense points of both scenes: a plane sweep of the photos tells both scenes' surfaces roughly; painted, each is taken
// off the photos, and the other is looked for again in what is left.
#ifndef FS_INITIALISE_RESIDUAL_STEREO_H
#define FS_INITIALISE_RESIDUAL_STEREO_H

#include "base/log.h"
#include "initialise/colored_seeds.h"

// points->dense is not read. dense[2]: transmitted, reflected; they may come out empty.
int fs_residual_stereo_find(const Frames *frames, const Material *points, const FlashLight *light,
                            const DepthOdds *odds, uint64_t seed, const Log *log, Threads *threads,
                            DensePoints dense[2], FsError *err);

#endif

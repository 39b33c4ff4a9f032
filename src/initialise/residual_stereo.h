// Dense points of both scenes: stereo on the photos tells both scenes' surfaces roughly; with colours, the transmitted
// one is subtracted from the photos, and the mirrored one is looked for again in what is left.
#ifndef FS_INITIALISE_RESIDUAL_STEREO_H
#define FS_INITIALISE_RESIDUAL_STEREO_H

#include "initialise/start.h"

// start->dense is not read. dense[2]: transmitted, reflected; they may come out empty.
int fs_residual_stereo_find(const Start *start, PointList dense[2], FsError *err);

#endif

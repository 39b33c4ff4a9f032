// The export stage: OUT/clouds -> OUT/export/<layer>.ply and .splat, which the usual viewers open.
#ifndef FS_EXPORT_EXPORT_H
#define FS_EXPORT_EXPORT_H

#include "model/project.h"

int fs_export_run(FsProject *project, FsError *err);

#endif

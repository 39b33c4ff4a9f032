// The export stage: OUT/clouds -> OUT/export/<layer>.ply and .splat, which the usual viewers open.
#pragma once

#include "model/project.h"

int fs_export_run(FsProject *project, FsError *err);

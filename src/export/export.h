// The export stage: OUT/clouds -> OUT/export/<layer>.*, in formats that other programs open.
#pragma once

#include "model/project.h"

int fs_export_run(FsProject *project, FsError *err);

// The export stage: OUT/clouds -> OUT/export/<layer>.*, in formats that other programs open.
#pragma once

#include "model/cost.h"
#include "model/project.h"

int fs_export_run(FsProject *project, FsError *err);
int fs_export_check(const Settings *set, FsError *err); // before hours of training: its settings go with theirs
// What --clean will take but for its renders, by one of the photos of `folder` (NULL: where ingest found them); nothing
// without. FS_ERR_INPUT where the stages will say what is wrong.
int fs_export_estimate(const FsProject *project, const char *folder, RunCost *cost, FsError *err);

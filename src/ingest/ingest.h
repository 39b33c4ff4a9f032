// From a folder of photos to linear working images: OUT/linear and OUT/ingest.json.
#pragma once

#include "model/cost.h"
#include "model/project.h"

int fs_ingest_run(FsProject *project, const char *folder, FsError *err);

// Which photos there are, which the stage's mark tells (project.h). Photos that are gone do not matter once they are
// ingested; false where a folder is there, but holds none.
bool fs_ingest_look(FsProject *project, const char *folder);
// What it will take, by developing one photo. FS_ERR_INPUT where ingest itself will say what is wrong.
int fs_ingest_estimate(const FsProject *project, const char *folder, RunSize *size, RunCost *cost, FsError *err);

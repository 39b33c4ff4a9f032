// From a folder of photos to linear working images: OUT/linear and OUT/ingest.json.
#pragma once

#include "model/project.h"

int fs_ingest_run(FsProject *project, const char *folder, FsError *err);

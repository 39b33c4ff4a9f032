// From a folder of photos to linear working images: OUT/linear and OUT/ingest.json.
#ifndef FS_INGEST_INGEST_H
#define FS_INGEST_INGEST_H

#include "model/project.h"

int fs_ingest_run(FsProject *project, const char *folder, FsError *err);

#endif

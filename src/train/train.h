// The training stage: from OUT/start to OUT/clouds.
#ifndef FS_TRAIN_TRAIN_H
#define FS_TRAIN_TRAIN_H

#include "model/project.h"

int fs_train_run(FsProject *project, FsError *err);

#endif

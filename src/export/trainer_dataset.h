// The capture without the reflection, for programs that train on posed photos.
#pragma once

#include "export/colors.h"
#include "model/dataset.h"
#include "model/project.h"

typedef struct TrainerArgs {
    const FsProject *project;
    const Scene *scene;
    const Dataset *photos;
    const Development *development;
} TrainerArgs;

// export/dataset/: images/<photo>.png, T without flash at each photo's pose, undistorted, at working size, in the
// colours of the clouds; sparse/0/, a COLMAP model (binary) of them, with points of T.
int fs_trainer_dataset_run(const TrainerArgs *args, FsError *err);

// The capture for other programs: without the reflection, for those that train on posed photos; or the photos as they
// are, for those that separate.
#pragma once

#include "export/colors.h"

// export/dataset/: images/<photo>.png, undistorted, at working size; of photos masks/<photo>.png.png; sparse/0/, a
// COLMAP model (binary) of them. By the setting dataset-of: "transmitted", T without flash at each photo's pose, in the
// colours of the clouds, and points of T; "photos", the photos in camera RGB by sRGB's curve, the points of the poses,
// and pairs.txt, a line for each flash photo: its file, that of the nearest photo without flash, and the distance of
// the two.
int fs_trainer_dataset_run(const ExportArgs *args, FsError *err);

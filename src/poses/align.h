// Brings two models of the same scene, made apart, into one frame.
#ifndef FS_POSES_ALIGN_H
#define FS_POSES_ALIGN_H

#include "base/log.h"
#include "model/colmap_model.h"
#include "poses/capture.h"
#include "poses/features.h"

// Moves `moving` (poses and points) into the frame of `fixed` by the similarity that most points agree with whose
// features look alike in both.
int fs_align_groups(const Capture *capture, const Features *features, const ColmapModel *fixed, ColmapModel *moving,
                    const Log *log, FsError *err);

#endif

// Folders that research data sets come as: the photos in a subfolder, with poses beside them. Of Flash-Splat's authors:
// images_npy/ (a camera's values, .npy) and images/ (the same developed); of LLFF, NeRFReN's RFFR and COLMAP: images/.
// Poses: sparse/0 or another place for a COLMAP model, transforms.json, or LLFF's poses_bounds.npy.
#pragma once

#include "base/file.h"
#include "base/log.h"
#include "model/settings.h"

#define FS_SCENE_FOLDER_BOUNDS "poses_bounds.npy"

typedef struct SceneFolder {
    const char *photos; // "images_npy" or "images"
    FilePath poses;     // "": none there
    FilePath points;    // a dense cloud; "": none there
    FilePath fused[2];  // of the photos without flash and with it; "": not both there
    int stray;          // pictures beside them that are not taken
} SceneFolder;

bool fs_scene_folder_find(SceneFolder *scene, const char *folder); // false: it is none of these
// Of `run`: takes the folder's poses where the settings name none, and says so.
int fs_scene_folder_take(Settings *set, const char *folder, const Log *log, FsError *err);

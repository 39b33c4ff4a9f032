// Reads "any camera model": a COLMAP folder, nerfstudio's transforms.json, LLFF's poses_bounds.npy, or our own
// views.json / cameras.json.
#pragma once

#include "model/colmap_model.h"
#include "model/dataset.h"

typedef struct CamerasFile {
    Dataset views;     // pinhole cameras at the model's own image size; flash and held_out where the file tells
    Lens *lens;        // (views.n) the same intrinsics with distortion
    ColmapModel model; // of a COLMAP folder: everything in it; else empty
    int *image;        // (views.n) index of each view in model.image; NULL without a model
} CamerasFile;

typedef struct PosedView { // of a file, in any order
    char *name;            // first, see order.h
    const char *path;      // borrowed: what the file says, with folder and extension; NULL: nothing
    Lens lens;
    double w2c[12];
    int image;
} PosedView;

// FS_ERR_INPUT names the file, and what was expected of it. `file` is {0} after a failure.
int fs_cameras_file_read(const char *path, CamerasFile *file, FsError *err);
void fs_cameras_file_free(CamerasFile *file);

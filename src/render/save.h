// Rendered layers as files, in the encodings that other programs compare:
//
//   <dir>/<layer>/<view>.png   colour: 8-bit, (linear / white)^0.22 * 255; beta: 16-bit grey, beta * 65535;
//                              depth: 16-bit grey, millimetres, 0 where nothing is (scale known)
//   <dir>/<layer>/<view>.tif   32-bit float: depth in world units (scale unknown); any layer in linear light (on wish)
//   <dir>/unseen/<view>.png    where R is a guess (unseen.h): 8-bit grey, 255, else 0
#pragma once

#include "base/file.h"
#include "engine/engine.h"

#define SAVE_DEPTH_MM 65535.0 // the most that 16 bits hold; what is beyond is 0

typedef struct SaveScale {
    double metres_per_unit; // 0: unknown
    float white;            // light that is 255 in a PNG (fs_scene_white)
} SaveScale;

// What is not written is removed where an earlier run left it. linear: writes the float TIFF of colours and beta too.
int fs_save_layer(const char *dir, RenderLayer layer, const char *view, const Image *image, SaveScale scale,
                  bool linear, FsError *err);
int fs_save_unseen(const char *dir, const char *view, const Image *mask, FsError *err); // mask NULL: there is none
FilePath fs_save_unseen_path(const char *dir, const char *view);
// Removes the renders of all layers in dir, and the films in the folder `films`, that are older than the file `than`
// (NULL: all): they show another scene; and what folders that leaves empty. Returns how many files.
int fs_save_drop_older(const char *dir, const char *films, const char *than);
// The folder of a layer, made when missing.
int fs_save_prepare(const char *dir, RenderLayer layer, FsError *err);

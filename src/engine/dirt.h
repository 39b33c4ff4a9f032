// Dirt on the pane, found in photos by what they hold beyond their renders. Beside the seam: it asks an engine for
// renders, and computes the rest in host memory.
#pragma once

#include "base/threads.h"
#include "engine/engine.h"
#include "model/dataset.h"

enum {
    DIRT_SIDE = 150,  // pixels of a photo's longer side, at most
    DIRT_PHOTOS = 24, // of each lighting that are enough
    DIRT_FEWEST = 8,  // and as many must be there: fewer agree by chance
};

typedef struct DirtPhoto {
    const View *view;
    PhotoState state;
    Camera camera;     // of the pictures
    Image photo, mask; // as fs_dataset_load_view gives them, made small; the caller's
} DirtPhoto;

typedef struct DirtArgs {
    Engine *engine;     // a scene is up, trained so far that its renders are like the photos
    const Scene *scene; // its numbers
    Threads *threads;
    DirtPhoto *photo; // (n)
    int n;
} DirtArgs;

// 1: found, and `veil` is an even one on the pane's plane; 0: there is none, or there are too few photos to tell.
int fs_dirt_find(const DirtArgs *args, Veil *veil, FsError *err);

// What photos hold beyond their renders, made to tell what is neither behind the pane nor mirrored in it.
#pragma once

#include "base/threads.h"
#include "image/image.h"
#include "kernels/planes.h"
#include "model/camera.h"

typedef enum ResiduePlane {
    RESIDUE_SUM, // light beyond the render, times its weight
    RESIDUE_WEIGHT,
    RESIDUE_NOTHING, // so that these three are read as a picture's
    RESIDUE_DEPTH,   // of T and of R; 0 where there is none
    RESIDUE_EXPECTED = RESIDUE_DEPTH + 2,
    RESIDUE_PLANES
} ResiduePlane;

typedef struct Residue { // of a photo
    bool flash;
    Camera camera;
    Planes px; // RESIDUE_PLANES
} Residue;

// Of `photo` beyond `whole`, its render, grey and without what is broad; it weighs more where the photo is less noisy
// and the render has no edges. depth: of T and of R at the photo's pixels. The camera and its lighting are the
// caller's.
int fs_residue_fill(Residue *residue, const Image *photo, const Image *mask, const Image *whole,
                    const Image *const depth[2], FsError *err);
void fs_residue_free(Residue *residue);
// Where a scene is not yet as it should be, all photos of a lighting see the same wrong light there: what each one has
// of what the others expect at T's depth is taken off, then at R's.
int fs_residue_clear_scenes(Residue *residue, int n, Threads *threads, FsError *err);

// Where the mirrored scene is a guess, for fewer than five photos (of fewer than 20: a quarter) show it clear of the
// photographer, as training found them (OUT/clouds/photos.json).
#pragma once

#include "model/dataset.h"

typedef struct Hider { // what hides the mirrored scene in one photo
    Camera camera;
    int width, height;
    unsigned char *hides; // (height, width) over the photo's frame
} Hider;

typedef struct Unseen {
    int n; // 0: nobody was found
    Hider *hider;
} Unseen;

int fs_unseen_open(Unseen *unseen, const char *out, const Dataset *photos, FsError *err);
void fs_unseen_close(Unseen *unseen);
// mask (camera height, camera width, 1), made anew: 1 where R is a guess, else 0. depth:
// RENDER_DEPTH_R at that camera; where nothing is, what is there is taken to be as far away as the rest.
int fs_unseen_mask(const Unseen *unseen, const Camera *camera, const Image *depth, Image *mask, FsError *err);

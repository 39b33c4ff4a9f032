// A photo at its full size without the mirrored room, guided by what the clouds show at its pose.
//
// With I the photo, T and W = T + R the renders of the transmitted scene and of all light, as the photo shows them:
//
//   level = G(I) / G(W)           at working size, G a Gaussian: what the renders lack on a large scale
//   share = T / W                 of the light
//   gate  = P_T / (P_T + k P_R)   P: power of the renders' finest detail around a pixel: whose outlines are there
//
//   clean = (1 - gate) level T + gate share I
//
// Where T has the detail, the photo comes through in full resolution, less the mirrored light's share; where the
// mirrored room has it, its outlines stay out, and T is the render, brought to the photo's brightness. Where there is
// no mirrored light, W = T and the photo stays as it is.
#pragma once

#include "base/threads.h"
#include "image/image.h"

typedef struct CleanGuide {
    Image T, whole;    // in the photo's exposure and geometry; whole >= T. The caller's to fill, in linear light
    float full;        // what a clipped value is; the caller's too
    Image level, gate; // at working size; 3 channels and 1
} CleanGuide;

// From the guide's renders (at least of the photo's working size): level and gate. small: the photo at working size;
// clipped: which share of a pixel is; masked (NULL: none): 1 where what stands there is not to count.
int fs_clean_photo_guide(CleanGuide *guide, const Image *small, const Image *clipped, const Image *masked,
                         FsError *err);
// The photo (3 channels, any size) in place. clipped: 1 channel of its size; there its
// light is the least there was, in the channels that are (nearly) full.
int fs_clean_photo_apply(const CleanGuide *guide, Threads *threads, Image *photo, const Image *clipped, FsError *err);
void fs_clean_photo_free(CleanGuide *guide);

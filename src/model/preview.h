// Pictures for people: one exposure for everything shown of a capture, and small display pictures of linear images.
// Numbers meant for programs never go through here; see image/tone.h.
#pragma once

#include "model/dataset.h"

typedef struct PreviewLight {
    float exposure;             // multiplies linear light, before the shoulder and the sRGB curve
    bool has_matrix;            // the capture says what its camera RGB means
    double srgb_from_camera[9]; // (3, 3) row-major, linear
} PreviewLight;
// What the capture's colours mean, where ingest knew it from the RAW files. The exposure is left alone.
void fs_preview_matrix(const char *out, PreviewLight *light);
// The same, and the exposure of the pleasant tone curve, from an even choice of the capture's photos.
int fs_preview_light(const char *out, const Dataset *dataset, PreviewLight *light, FsError *err);
// Linear camera RGB to display values 0..1.
void fs_preview_develop(const PreviewLight *light, float color[3]);
// A display picture of a linear image (grey: without the matrix), averaged down to a longer side of long_edge pixels (0
// or larger: as it is).
int fs_preview_picture(const Image *linear, int long_edge, const PreviewLight *light, Image *picture, FsError *err);
// The same averaging alone.
int fs_preview_shrink(const Image *image, int long_edge, Image *smaller, FsError *err);
// Up to `most` views, spread evenly over the capture, flash and no-flash in turn; returns how many.
int fs_preview_choose(const Dataset *dataset, int most, int *chosen);

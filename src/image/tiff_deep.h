// TIFF of 16 bits a channel, with tags (tags.h): pictures to edit, and linear DNG, which is TIFF.
#pragma once

#include "image/image.h"
#include "image/tags.h"

// What a linear DNG says of its camera.
typedef struct DngCamera {
    const char *name;          // UniqueCameraModel
    double camera_from_xyz[9]; // (3, 3) under D65, row-major
    double neutral[3];         // camera RGB of a grey thing
    double baseline_exposure;  // stops
} DngCamera;

// RGB, 0..1, clamped. Deflate-compressed. tags: the shot's; icc may be NULL.
int fs_tiff_deep_write(const char *path, const Image *image, const Tags *tags, const void *icc, size_t icc_size,
                       FsError *err);
// Linear camera RGB, not white-balanced, 1.0 = sensor white. Uncompressed, as all readers of DNG take it.
int fs_tiff_deep_write_dng(const char *path, const Image *image, const Tags *tags, const DngCamera *camera,
                           FsError *err);

// How a camera turns white-balanced sensor light into the picture of its JPEG files.
#pragma once

#include "base/rng.h"
#include "image/image.h"

// value = curve(matrix * light), then sharpened; all zero: plain sRGB.
typedef struct CameraStyle {
    bool own;        // not plain sRGB
    float lift;      // the shadows are made 1 + lift times as bright; the light rolls off towards white
    float contrast;  // steepness of the S in the coded values, about `middle`
    float middle;    // coded
    float matrix[9]; // (3, 3), rows sum to 1
    float sharpen;   // how much of what differs from the surroundings is added
} CameraStyle;

CameraStyle fs_style_draw(float strength, Rng rng);                       // one out of the range of real cameras
float fs_style_curve(const CameraStyle *style, float light);              // coded value, both 0..1
int fs_style_apply(const CameraStyle *style, Image *image, FsError *err); // 3 channels, in place

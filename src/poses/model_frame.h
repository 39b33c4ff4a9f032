// How the picture that a COLMAP model is of lies in the photo as one sees it. COLMAP takes photos as they are stored
// and does not turn them as EXIF says (colmap/colmap#1406), and of RAW photos it had the camera's JPEGs, which leave
// some pixels at the edges out.
#pragma once

#include "model/lens.h"
#include "poses/capture.h"

typedef struct ModelFrame {
    int quarters;      // of a turn clockwise that make the picture upright
    double margin[2];  // pixels of the photo left of and above the picture
    int width, height; // of the whole photo, upright, in the picture's pixels
} ModelFrame;

// lens: of the model's picture. file: the picture's name in the model; NULL: the model says no such thing.
ModelFrame fs_model_frame(const Photo *photo, const Lens *lens, const char *file);
// The lens of the whole upright photo.
Lens fs_model_frame_lens(const ModelFrame *frame, const Lens *lens);
void fs_model_frame_pose(const ModelFrame *frame, double w2c[12]);
// xy: pixel of the model's picture, whose lens is given -> of the whole upright photo.
void fs_model_frame_pixel(const ModelFrame *frame, const Lens *lens, double xy[2]);

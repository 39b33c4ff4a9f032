// Lens distortion: COLMAP's perspective and fisheye camera models, between the ray of an ideal pinhole and the photo.
#pragma once

#include "base/error.h"
#include "model/camera.h"

#define FS_LENS_MAX_PARAMS 16

typedef enum LensModel { // numbers as in COLMAP's binary files
    LENS_SIMPLE_PINHOLE,
    LENS_PINHOLE,
    LENS_SIMPLE_RADIAL,
    LENS_RADIAL,
    LENS_OPENCV,
    LENS_OPENCV_FISHEYE,
    LENS_FULL_OPENCV,
    LENS_FOV,
    LENS_SIMPLE_RADIAL_FISHEYE,
    LENS_RADIAL_FISHEYE,
    LENS_THIN_PRISM_FISHEYE,
    LENS_MODELS // models from here on are known by name and size only
} LensModel;

typedef struct Lens {
    int model; // LensModel, or a later COLMAP number that cannot be projected with
    int width, height;
    double param[FS_LENS_MAX_PARAMS]; // in COLMAP's order
} Lens;

// COLMAP's name of a model, and its number of parameters; NULL when there is no such model.
const char *fs_lens_model_name(int model, int *n_params);
int fs_lens_model_find(const char *name); // -1 when there is no such model

// Intrinsics without the distortion; pose left zero. Error when the model cannot be projected with or is degenerate.
int fs_lens_camera(const Lens *lens, const char *file, Camera *camera, FsError *err);
bool fs_lens_is_pinhole(const Lens *lens); // no distortion (all its coefficients are 0)
bool fs_lens_equal(const Lens *a, const Lens *b);
Lens fs_lens_from_camera(const Camera *camera);
Lens fs_lens_resized(const Lens *lens, int width, int height);
// Of the same pictures turned about the axis by `quarters` of a turn clockwise, 0 to 3. Its rays are turned alike.
Lens fs_lens_turned(const Lens *lens, int quarters);
// Of pictures with so much more around them. margin: pixels left of and above what was there.
Lens fs_lens_padded(const Lens *lens, const double margin[2], int width, int height);

// Ray (x/z, y/z) -> photo pixel.
void fs_lens_project(const Lens *lens, const double ray[2], double pixel[2]);
// Photo pixel -> ray; false where the model cannot be inverted.
bool fs_lens_unproject(const Lens *lens, const double pixel[2], double ray[2]);
// How many times wider and higher than the photo a picture without the distortion is that holds all the photo shows, at
// the same focal length and about the same centre; 1 to `most`.
double fs_lens_widening(const Lens *lens, double most);

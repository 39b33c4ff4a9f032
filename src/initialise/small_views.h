// The capture's photos at the small size the start works at, and the view from the middle of all cameras.
#ifndef FS_INITIALISE_SMALL_VIEWS_H
#define FS_INITIALISE_SMALL_VIEWS_H

#include "image/image.h"
#include "model/camera.h"
#include "model/dataset.h"

typedef struct SmallView {
    Camera camera; // of `photo`
    double centre[3];
    bool flash;
    Image photo;            // linear RGB; NAN where the pixel is not to be trusted
    unsigned char *clipped; // 1 where it is clipped; masked ones are not
} SmallView;

typedef struct SmallViews {
    SmallView *view; // (n); held-out views left out
    int n, n_flash;
    double centre[3];                     // mean of the cameras' centres
    double right[3], down[3], forward[3]; // mean orientation, orthonormal
    double extent;                        // fs_camera_extent of the cameras
    double focal_px;                      // mean
    double lift;                          // of the photos' light (fs_dataset_lift)
} SmallViews;

// The photos of OUT/images that are trained on, with a longer side of long_edge pixels at most.
int fs_small_views_load(SmallViews *views, const char *out, const Dataset *dataset, int long_edge, FsError *err);
// Fills in what follows from the cameras (centres, mean orientation, extent) once `view` is filled.
void fs_small_views_finish(SmallViews *views);
void fs_small_views_free(SmallViews *views);

// A point in the middle view: (x / z, y / z, log z); false when it is not in front.
bool fs_small_views_direction(const SmallViews *views, const float xyz[3], float uvl[3]);
// Photo at a position in pixels (pixel centres at +0.5), bilinear; false outside and on pixels not to be trusted.
bool fs_small_views_sample(const SmallView *view, double x, double y, float rgb[3]);
// World position of the point of depth z seen at a pixel.
void fs_small_views_unproject(const Camera *camera, double x, double y, double z, float xyz[3]);

#endif

// What poses hands on: where each photo was taken from, and points with the photos that see them.
#pragma once

#include "model/colmap_model.h"
#include "model/dataset.h"
#include "model/project.h"
#include "poses/capture.h"
#include "poses/colmap.h"
#include "poses/model_frame.h"
#include "poses/triangulate.h"

typedef struct Pose { // of one photo
    bool known;
    ModelFrame frame; // of a model of the user's
    Lens lens;        // at the size of the photo's picture for feature detection
    Camera camera;    // without the distortion, of that size; sees all that the photo shows
} Pose;

typedef struct Sighting { // an observation, in the pinhole camera of the photo at the size of its picture
    int photo;
    double x, y;
} Sighting;

typedef struct SparsePoint {
    double xyz[3], error;
    unsigned char rgb[3];
    int first, n; // sightings
} SparsePoint;

typedef struct Sparse {
    Pose *pose; // (capture->n)
    SparsePoint *point;
    Sighting *sighting;
    int n_points, n_sightings;
} Sparse;

int fs_sparse_new(Sparse *sparse, const Capture *capture, FsError *err); // all poses unknown
void fs_sparse_free(Sparse *sparse);

// Poses out of a model that COLMAP made of the capture's pictures.
int fs_sparse_from_colmap(Sparse *sparse, const Capture *capture, const ColmapModel *model, FsError *err);
// Poses (and points with at least two sightings) out of a COLMAP model or another camera file; other views are ignored.
// A view is the photo's of its name, or of that in other letter case where no other could be meant.
int fs_sparse_from_file(Sparse *sparse, const Capture *capture, const char *path, FsError *err);

// A model of the posed photos and the points of at least `least` sightings. as_taken: the pictures for feature
// detection with their lenses; else the working images without distortion.
int fs_sparse_to_colmap(const Sparse *sparse, const Capture *capture, int least, bool as_taken, ColmapModel *model,
                        FsError *err);

// Replaces the points by ones triangulated from features, which have no colours yet.
int fs_sparse_triangulate(Sparse *sparse, const FsProject *project, const Capture *capture, const Features *features,
                          FsError *err);

// The points' colours in the pictures, mean over the sightings.
int fs_sparse_colour(Sparse *sparse, const Capture *capture, FsError *err);

// Moves `moving` (poses and points) into the frame of `fixed`, a model of the same scene made apart, by the similarity
// that most points agree with whose features look alike in both.
int fs_align_groups(const Capture *capture, const Features *features, const ColmapModel *fixed, ColmapModel *moving,
                    const Log *log, FsError *err);
// Poses, focal lengths and distortion once more by least squares over the triangulated points, whose tracks are longer
// and whose features are finer than those the poses were found with. Replaces the poses and lenses; the points are left
// as they were. Keeps everything, with a warning, when it cannot be done.
int fs_adjust_poses(Colmap *colmap, Sparse *sparse, FsError *err);

// Writes OUT/images, OUT/sparse, OUT/views.json.
int fs_sparse_write(const Sparse *sparse, const FsProject *project, const Capture *capture, FsError *err);
// Marks every Nth photo of each lighting; true when that changes anything.
bool fs_sparse_hold_out(Dataset *views, int every);

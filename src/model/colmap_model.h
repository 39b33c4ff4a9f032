// COLMAP models (cameras, images, points with tracks), text and binary, as COLMAP 3.8 to 4.x writes them.
// The rigs and frames files of COLMAP 4 are not needed: its images files hold the composed poses.
#pragma once

#include <stdio.h>
#include <stdint.h>

#include "base/error.h"
#include "model/lens.h"

enum { FS_COLMAP_FEWEST_POINTS = 20 }; // below which nothing can be told of a scene

typedef struct ColmapCamera {
    uint32_t id;
    Lens lens;
} ColmapCamera;

typedef struct ColmapObservation {
    double x, y;   // pixels of the photo
    int64_t point; // ColmapPoint.id, or -1
} ColmapObservation;

typedef struct ColmapImage {
    uint32_t id, camera_id;
    double quat[4], t[3]; // world-to-camera, w x y z
    char *name;           // with folder and extension as in the file
    int first, n;         // its observations: ColmapModel.observation[first .. first + n)
} ColmapImage;

typedef struct ColmapTrack {
    uint32_t image_id;
    uint32_t index; // into the observations of that image
} ColmapTrack;

typedef struct ColmapPoint {
    int64_t id;
    double xyz[3];
    double error; // mean reprojection error in pixels
    unsigned char rgb[3];
    int first, n; // its track: ColmapModel.track[first .. first + n)
} ColmapPoint;

typedef struct ColmapModel {
    ColmapCamera *camera;
    ColmapImage *image;
    ColmapPoint *point;
    ColmapObservation *observation;
    ColmapTrack *track;
    int n_cameras, n_images, n_points, n_observations, n_tracks;
} ColmapModel;

void fs_colmap_model_free(ColmapModel *model);

// Reads cameras, images and (if there) points3D of a folder; .bin is preferred to .txt.
// Also looks into <dir>/sparse/0, <dir>/sparse, <dir>/0 and <dir>/colmap/sparse/0.
int fs_colmap_model_read(const char *dir, ColmapModel *model, FsError *err);
char *fs_colmap_model_find(const char *dir); // the folder that holds the model; caller frees; NULL when there is none
// Text files; binary when asked.
int fs_colmap_model_write(const char *dir, const ColmapModel *model, bool binary, FsError *err);

// Looking up by number; NULL or -1 when missing.
const ColmapCamera *fs_colmap_model_camera(const ColmapModel *model, uint32_t id);
int fs_colmap_model_image(const ColmapModel *model, uint32_t id);

// For building a model: space for one more; NULL when out of memory. Strings are copied.
ColmapCamera *fs_colmap_model_add_camera(ColmapModel *model, FsError *err);
ColmapImage *fs_colmap_model_add_image(ColmapModel *model, const char *name, FsError *err);
ColmapPoint *fs_colmap_model_add_point(ColmapModel *model, FsError *err);
// Appends to the observations or tracks of the image or point added last.
int fs_colmap_model_add_observation(ColmapModel *model, ColmapObservation observation, FsError *err);
int fs_colmap_model_add_track(ColmapModel *model, ColmapTrack track, FsError *err);

// Private to colmap_*.c: what a format's files are called, and how each is read and written.
typedef enum ColmapPart { COLMAP_CAMERAS, COLMAP_IMAGES, COLMAP_POINTS, COLMAP_PARTS } ColmapPart;
typedef struct ColmapFormat {
    const char *ext;
    // data: the whole file with a 0 behind it; may be changed
    int (*read)(const char *path, char *data, size_t size, ColmapPart part, ColmapModel *model, FsError *err);
    void (*write[COLMAP_PARTS])(FILE *f, const ColmapModel *model);
} ColmapFormat;
extern const ColmapFormat fs_colmap_binary, fs_colmap_text;

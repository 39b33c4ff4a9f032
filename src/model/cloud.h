// A cloud of 3D Gaussians, structure of arrays. One table of fields drives append, compact, Adam, PLY and checkpoint.
#pragma once

#include <stdbool.h>

#include "base/error.h"

typedef enum CloudField {
    CLOUD_MEANS,     // (N, 3) world
    CLOUD_SCALES,    // (N, 3) log of the standard deviation
    CLOUD_QUATS,     // (N, 4) w x y z, any length
    CLOUD_OPACITIES, // (N, 1) logit
    CLOUD_COLORS,    // (N, 3 or 1) tone-mapped (x^0.22) camera RGB, or the logit of beta
    CLOUD_GAINS,     // (N, 0 or 1) log of the flash gain alpha, only where one geometry holds both lightings
    CLOUD_COVERS,    // (N, 0 or 1) 0..1, how much of the mirrored light is missing before it; where bars were found
    CLOUD_FIELDS
} CloudField;

typedef struct CloudFieldInfo {
    const char *name;   // "means"
    const char *ply[4]; // PLY property names of our own files
    int width;          // floats per Gaussian; colours and gains: see Cloud.width
} CloudFieldInfo;
extern const CloudFieldInfo fs_cloud_fields[CLOUD_FIELDS];

typedef struct Cloud {
    int n, capacity;
    int width[CLOUD_FIELDS];    // floats per Gaussian of each field (0: field absent)
    float *field[CLOUD_FIELDS]; // (capacity, width)
} Cloud;

int fs_cloud_new(Cloud *cloud, int n, int color_width, int gain_width, FsError *err); // n zeroed Gaussians
int fs_cloud_new_like(Cloud *cloud, const Cloud *like, int n, FsError *err);          // of the same widths
void fs_cloud_free(Cloud *cloud);
int fs_cloud_resize(Cloud *cloud, int n, FsError *err);         // new ones zeroed
int fs_cloud_copy(Cloud *to, const Cloud *from, FsError *err);  // `to` is made anew
int fs_cloud_covers(Cloud *cloud, bool wanted, FsError *err);   // has them from now on, all 0 if new; or not
void fs_cloud_compact(Cloud *cloud, const unsigned char *keep); // keep (N): drops the Gaussians with 0

// Our own PLY (binary little-endian, exact floats, every field). Reading checks the header, counts and finiteness.
int fs_cloud_ply_write(const Cloud *cloud, const char *path, FsError *err);
int fs_cloud_ply_read(Cloud *cloud, const char *path, FsError *err);

// Plain coloured points as PLY (x y z red green blue [value]), for looking at. rgb (N, 3) 0..255; value may be NULL.
int fs_cloud_points_write(const char *path, int n, const float *xyz, const unsigned char *rgb, const float *value,
                          FsError *err);

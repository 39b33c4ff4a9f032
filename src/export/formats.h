// The formats that clouds are exported in, one row each; a row's writer is in the file of its name.
#pragma once

#include "export/splats.h"

typedef struct Format {
    const char *name;   // in the setting "formats"
    const char *ending; // of the file: <layer>.<ending>
    SplatsOrder order;
    bool y_up;                                                          // y up and z back; else the frame of the poses
    long long most;                                                     // Gaussians that a file, or its readers, take
    int (*write)(const Splats *splats, const char *path, FsError *err); // NULL: no cloud but the mesh (surface.h)
    float size[2]; // logarithms of the least and greatest standard deviation it holds; 0, 0: all
} Format;

enum { FORMATS = 9 };
extern const Format fs_formats[FORMATS];

int fs_inria_write(const Splats *splats, const char *path, FsError *err);
int fs_splat_write(const Splats *splats, const char *path, FsError *err);
int fs_spz_write(const Splats *splats, const char *path, FsError *err);
int fs_spz_write_old(const Splats *splats, const char *path, FsError *err); // version 2
int fs_compressed_ply_write(const Splats *splats, const char *path, FsError *err);
int fs_sog_write(const Splats *splats, const char *path, FsError *err);
int fs_point_cloud_write(const Splats *splats, const char *path, FsError *err);
int fs_glb_write(const Splats *splats, const char *path, FsError *err);

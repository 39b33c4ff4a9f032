// Triangles with a colour at each corner.
#pragma once

#include <stdint.h>

#include "export/tsdf.h"

typedef struct Mesh {
    int n, capacity;    // vertices
    float *xyz;         // (N, 3) world
    unsigned char *rgb; // (N, 3) display values
    int triangles, triangle_capacity;
    uint32_t *corner; // (triangles, 3), counter-clockwise seen from before the surface
} Mesh;

void fs_mesh_free(Mesh *mesh);
// The surface between voxels before and behind it that at least `views` views have seen (surface nets: a vertex in
// each cell of eight voxels that it goes through). rgb is black.
int fs_mesh_extract(const Tsdf *tsdf, int views, Mesh *mesh, FsError *err);
// Drops pieces of less than `share` of all triangles: what floats about.
int fs_mesh_drop_pieces(Mesh *mesh, double share, FsError *err);
int fs_mesh_write(const Mesh *mesh, const char *path, FsError *err); // PLY

// Candidates for a feature in another photo whose pose is known: the most alike features along its epipolar line.
#pragma once

#include "poses/triangulate.h"

enum { FS_EPIPOLAR_CANDIDATES = 3 };

typedef struct Candidate {
    int feature;     // in the other photo
    float inverse_z; // of the point along the ray of the first photo's feature
} Candidate;

typedef struct Candidates { // of one feature in one other photo
    int n;
    Candidate candidate[FS_EPIPOLAR_CANDIDATES];
} Candidates;

// A photo as the search needs it.
typedef struct SearchPhoto {
    const Features *features;
    const Camera *camera;
    float *ray; // (n, 2) x/z, y/z
} SearchPhoto;

// Fills out (a->features->n). max_inverse_z: nearest depth worth looking at. length_px: how long the searched part of
// a line is (the room in which a wrong candidate may lie).
int fs_epipolar_search(const SearchPhoto *a, const SearchPhoto *b, double max_inverse_z,
                       const TriangulateOptions *options, Candidates *out, double *length_px, FsError *err);

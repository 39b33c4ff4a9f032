// What the writers of clouds get: the Gaussians of one layer, all of them finite, in the frame and the order of the
// format.
#pragma once

#include <stdbool.h>

#include "model/cloud.h"

// Value of the constant spherical harmonic: a viewer shows colour 0.5 + FS_SPLATS_SH0 * f_dc.
#define FS_SPLATS_SH0 0.28209479177387814

typedef struct Splats {
    int n;
    float *mean;     // (N, 3)
    float *scale;    // (N, 3) log of the standard deviation, at most FS_SPLATS_SCALE either way
    float *rotation; // (N, 4) unit, w x y z
    float *opacity;  // (N) logit
    float *srgb;     // (N, 3) display values
    bool has_pane;
    float pane[4][3]; // corners of the pane, for formats that can show it
} Splats;
#define FS_SPLATS_SCALE 40.0f // beyond it a size or its square is no float, and nothing a viewer could show

#define FS_SPLATS_FAR 1000.0 // times as far from the origin as nearly all others: nothing is seen of it either

// Copies of a cloud and its colours (N, 3), without the Gaussians that are no numbers, or beyond all measure.
int fs_splats_make(const Cloud *cloud, const float *srgb, Splats *splats, FsError *err);
void fs_splats_free(Splats *splats);

// Half a turn about the first axis: from y down, z forward (COLMAP, PLY) to y up, z back (glTF, SPZ).
void fs_splats_turn(Splats *splats);

// What is seen in a mirror, where it is: across the plane normal . x = distance, the normal of unit length. What would
// be beyond all floats there is left out.
void fs_splats_mirror(Splats *splats, const double normal[3], double distance);

typedef enum SplatsOrder {
    SPLATS_AS_TRAINED,
    SPLATS_BY_VISIBILITY, // the largest and most opaque first
    SPLATS_BY_PLACE,      // along a Z-order curve: neighbours are alike, which is what compresses
} SplatsOrder;
int fs_splats_sort(Splats *splats, SplatsOrder order, FsError *err);

double fs_splats_opacity(const Splats *splats, size_t i); // 0..1
// The largest coordinate, either way, of all but the farthest Gaussians: of `share` of them.
int fs_splats_reach(const Splats *splats, double share, double *reach, FsError *err);
// Half of the longest side of the box that holds, along each axis, the middle `share` of them.
int fs_splats_spread(const Splats *splats, double share, double *spread, FsError *err);
// Least and greatest of the first of each of n triples; 0 and 0 of none.
void fs_splats_range(const float *value, int n, float range[2]);
// v rounded, 0..most; 0 where it is no number.
static inline unsigned fs_splats_level(double v, unsigned most)
{
    return !(v > 0) ? 0 : v >= most ? most : (unsigned)(v + 0.5);
}
// In three of four components of a unit quaternion is nothing beyond 1 / sqrt(2): times this they are in -0.5..0.5.
#define FS_SPLATS_HALF_ROOT 0.70710678118654752
// The largest component of a unit quaternion and the three others in their order, signed so that the largest is
// positive.
int fs_splats_smallest_three(const float rotation[4], float others[3]);

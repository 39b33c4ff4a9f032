// A cloud made small for the viewer: whole numbers of few bits, in planes (all of a kind one after the other), which
// deflate well. What they say:
//
//   place     p = centre + sign(u) reach (exp|u| - 1), u = low + step q: coarse far away, as eyes are. Gaussians go
//             along a Morton curve, and each number is the difference to the one before, zigzag, in two bytes
//   size      log of the standard deviation, evenly between two limits
//   turn      x, y, z of a unit quaternion with the largest possible w > 0: a Gaussian looks the same when its axes
//             change places, so that no turn is more than 63 degrees
//   opacity   its square root, evenly from 0 to 1
//   colour    tone-mapped, evenly between two limits: green, red - green, blue - green (or one number)
//   gain      evenly between two limits
//   cover     evenly from 0 to 1
//
// Gaussians that are never drawn (opacity under 1/255) are left out.
#pragma once

#include "model/cloud.h"

typedef struct PackRange {
    double low, high;
    int bits; // number = round((value - low) / (high - low) * (2^bits - 1))
} PackRange;

#define FS_PACK_TURN 0.62 // no component is larger

typedef struct Pack {
    int n, planes;
    unsigned char *byte; // (planes, n)
    double centre[3], reach, low[3], step;
    int bits; // of a place's number
    PackRange size, turn, opacity, color, gain, cover;
    int colors, gains, covers; // floats per Gaussian: 3 or 1; 0 or 1; 0 or 1
} Pack;

// centre: where one looks from, about.
int fs_pack_cloud(const Cloud *cloud, const double centre[3], Pack *pack, FsError *err);
void fs_pack_free(Pack *pack);

// The flash cue of one point: how much the contrast of its surroundings grows, in linear light, when the flash fires.
//
// A patch around the point, square to the middle view, is looked up in every photo and its mean taken off. What
// belongs to the point's own depth is the same in all photos of one lighting; what the other layer puts over it moves
// from photo to photo. So products of *different* photos' patches, averaged, hold the point's own contrast only:
//   a = <no-flash, no-flash>, b = <no-flash, flash>, c = <flash, flash>
// and the slope of flash on no-flash is that of the main axis of [a b; b c]: 1 + alpha behind the pane, 1 in it.
#ifndef FS_INITIALISE_CUE_H
#define FS_INITIALISE_CUE_H

#include "base/threads.h"
#include "initialise/small_views.h"

typedef struct Cue {
    bool ok;         // seen well enough for the rest to mean something
    float log_slope; // log of the contrast's growth
    float sigma;     // its standard deviation, by leaving out one photo at a time
    float coherence; // 0..1: share of the patches' contrast that belongs to this depth
    float contrast;  // of the point itself, linear light, without flash
    float slope[3];  // growth per colour channel; 0 where unknown
} Cue;

#define FS_CUE_SLOPE_MAX 20.0 // what is black without flash has no slope; this stands for it

// Slope of the main axis of [a b; b c], 0 where there is no common signal; and of what all photos hold along that axis
// the share that is common to them, given the mean products of photos with themselves, without and with flash.
double fs_cue_slope(double a, double b, double c, double own_without, double own_with, double *coherence);
void fs_cue_measure(const Frames *frames, const float *xyz, int n, Cue *cue, Threads *threads);

#endif

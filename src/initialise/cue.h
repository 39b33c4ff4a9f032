// The flash cue of one point: how much the contrast of its surroundings grows, in linear light, when the flash fires.
//
// A patch around the point, square to the middle view, is looked up in every photo and its mean taken off. What
// belongs to the point's own depth is the same in all photos of one lighting; what the other layer puts over it moves
// from photo to photo. So products of *different* photos' patches, averaged, hold the point's own contrast only:
//   a = <no-flash, no-flash>, b = <no-flash, flash>, c = <flash, flash>
// and the slope of flash on no-flash is that of the main axis of [a b; b c]: 1 + alpha behind the pane, 1 in it.
#ifndef FS_INITIALISE_CUE_H
#define FS_INITIALISE_CUE_H

#include "initialise/points.h"

// Slope of the main axis of [a b; b c], 0 where there is no common signal; and of what all photos hold along that axis
// the share that is common to them, given the mean products of photos with themselves, without and with flash.
double fs_cue_slope(double a, double b, double c, double own_without, double own_with, double *coherence);
void fs_cue_measure(const SmallViews *views, const float *xyz, int n, Cue *cue, Threads *threads);

#endif

// Lamps behind the pane, or mirrored ones. Neither the flash nor the contrast tells: photos show both clipped. But from
// place to place they move as what is as far away does, and the points that are known around there are of one scene or
// the other.
#ifndef FS_INITIALISE_LAMP_DEPTH_H
#define FS_INITIALISE_LAMP_DEPTH_H

#include "initialise/points.h"

// Places of some of what photos without the flash show clipped and is behind the pane; judged: of so many pixels.
// dense[2]: points of what is behind the pane and of the mirrored room; where a view sees too few of either, nothing is
// told. The caller frees `behind`.
int fs_lamp_depth_find(const SmallViews *views, const PointList *const dense[2], Threads *threads, PointList *behind,
                       int *judged, FsError *err);

#endif

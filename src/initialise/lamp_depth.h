// Lamps behind the pane, or mirrored ones. Neither the flash nor the contrast tells: photos show both clipped. But from
// place to place they move as what is as far away does, and lamps that are mirrored are with the mirrored room, which
// mostly begins behind the things: a lamp before all of that is among these.
#ifndef FS_INITIALISE_LAMP_DEPTH_H
#define FS_INITIALISE_LAMP_DEPTH_H

#include "initialise/points.h"

// Which share (0..1) of what photos without the flash show clipped lies before the mirrored room; dense[2]: points of
// what is behind the pane and of the room. 0 where little is clipped, or there is no room.
int fs_lamp_depth_behind(const SmallViews *views, const PointList *const dense[2], Threads *threads, double *behind,
                         FsError *err);

#endif

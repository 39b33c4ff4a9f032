// A dense cloud that the user has, in place of sparse points and stereo: some of its points get a cue and a kind, the
// others that of the nearest of these.
#ifndef FS_INITIALISE_GIVEN_POINTS_H
#define FS_INITIALISE_GIVEN_POINTS_H

#include "initialise/points.h"

// some: without cues and kinds yet; rest: the others. Points that no camera sees are left out.
int fs_given_points_read(const char *path, const SmallViews *views, SparsePoints *some, PointList *rest, FsError *err);
// The rest as points of the two scenes; those near unsure ones are left out.
int fs_given_points_split(const SparsePoints *some, const PointList *rest, Threads *threads, PointList dense[2],
                          FsError *err);

#endif

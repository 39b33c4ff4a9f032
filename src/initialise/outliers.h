// What is held against the other scene: dense points against the classified sparse ones, mirrored seeds against the
// transmitted surface. Where little of a scene shows, a sweep follows the other
// scene's features; but those points then lie among sparse points known to be of the other scene.
#ifndef FS_INITIALISE_OUTLIERS_H
#define FS_INITIALISE_OUTLIERS_H

#include "initialise/seeds.h"

// Drops from `dense`, of one scene, what lies nearer to sparse points of the other scene than to its own; of the
// mirrored scene only what lies hard by transmitted points: its sparse points are few, and near parts of it may have
// none. Does nothing where one of the kinds is missing.
int fs_outliers_drop(const SparsePoints *points, bool reflected, Threads *threads, PointList *dense, FsError *err);

// Which mirrored seeds lie before or on what is behind the pane, as `surface` (points of it) shows in the same
// direction from the middle of the cameras: before (seeds->n), 1 for those. The mirrored room lies behind the pane as
// the things do, and mostly behind them too; what is found at their place or before them is mostly they themselves.
// All 0 where it would be many: then the room is no farther than the things.
int fs_outliers_before(const SmallViews *views, const PointList *surface, const Seeds *seeds, Threads *threads,
                       unsigned char *before, FsError *err);

#endif

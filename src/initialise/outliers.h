// Dense points held against the classified sparse ones. Where little of a scene shows, a sweep follows the other
// scene's features; but those points then lie among sparse points known to be of the other scene.
#ifndef FS_INITIALISE_OUTLIERS_H
#define FS_INITIALISE_OUTLIERS_H

#include "initialise/points.h"

// Drops from `dense`, of one scene, what lies nearer to sparse points of the other scene than to its own; of the
// mirrored scene only what lies hard by transmitted points: its sparse points are few, and near parts of it may have
// none. Does nothing where one of the kinds is missing.
int fs_outliers_drop(const SparsePoints *points, bool reflected, Threads *threads, PointList *dense, FsError *err);

#endif

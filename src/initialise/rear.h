// The rear of the transmitted scene: a few planes that many of its points lie on and hardly any behind, as a room's far
// walls and floor, the back of a showcase or of a shelf; of each direction the nearest counts. Where nothing is found,
// as in the shade of a compartment, surfaces are carried on from what is around, which is mostly nearer (seeds.h).
// What is there in truth is then often the rear.
#ifndef FS_INITIALISE_REAR_H
#define FS_INITIALISE_REAR_H

#include "initialise/constants.h"
#include "initialise/first_colors.h"

typedef struct Rear {
    int n;
    double plane[REAR_PLANES][3]; // inverse depth in the middle view's direction (x / z, y / z): plane . (x/z, y/z, 1)
} Rear;

// By RANSAC (Fischler and Bolles 1981), one plane after the other; none where the points have no such plane.
int fs_rear_find(const SmallViews *views, const PointList *points, uint64_t seed, Rear *rear, FsError *err);
// Behind each transmitted seed that is not a point itself, one of the same colours on the rear. alpha is left as it is.
int fs_rear_add(const SmallViews *views, const Rear *rear, ColoredSeeds *seeds, FsError *err);

#endif

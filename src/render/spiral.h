// The spiral camera path of LLFF (Mildenhall et al. 2019): a closed loop around the average pose of a capture, always
// looking at one point in the scene.
//
//   average pose  centre = mean of the cameras' centres, axes from the means of their forward and up directions
//   focus depth   1 / ((1 - 0.75) / near + 0.75 / far), near = 0.9 * nearest, far = 5 * farthest depth of the scene
//   radii         90th percentile of the cameras' offsets from the centre, per axis of the average pose
//   frame i       angle a = 2 turns * i / n; centre + (cos a rx, sin a ry, sin(a / 2) rz), turned to the focus point
#pragma once

#include "base/error.h"
#include "model/camera.h"

typedef struct Spiral {
    double centre[3];                     // world
    double right[3], down[3], forward[3]; // unit axes of the average pose, world
    double radius[3];                     // along right, down, forward, world units
    double focus_depth;                   // of the point looked at, along forward from centre
} Spiral;

// nearest and farthest: depths that hold nearly all of the scene (say its 1st and 99th percentile), world units.
int fs_spiral_fit(Spiral *spiral, const Camera *cameras, int n, double nearest, double farthest, FsError *err);
// Frame i of n; intrinsics and size as in like.
Camera fs_spiral_camera(const Spiral *spiral, const Camera *like, int i, int n);

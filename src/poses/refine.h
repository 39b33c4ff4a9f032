// One point from its observations: least squares of the reprojection error.
#pragma once

#include <stdbool.h>

#include "model/camera.h"

typedef struct Sight { // one observation
    const Camera *camera;
    double pixel[2];
} Sight;

// Gauss-Newton from xyz; false when the point goes behind a camera or the rays do not fix it.
bool fs_refine_point(const Sight *sight, int n, double xyz[3]);
double fs_refine_error(const Sight *sight, const double xyz[3]); // pixels; huge behind the camera
// Largest angle between two rays to the point, degrees.
double fs_refine_angle(const Sight *sight, int n, const double xyz[3]);

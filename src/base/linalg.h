// Three-vectors of doubles. (synth/vec.h has the ray tracer's, of floats; the kernels have their own in lanes.)
#pragma once

#include <math.h>

static inline double v3_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void v3_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double v3_distance2(const double a[3], const double b[3]) // squared
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static inline double v3_normalise(double v[3]) // returns the length; 0 stays 0
{
    double length = sqrt(v3_dot(v, v));
    for (int i = 0; i < 3 && length > 0; i++) v[i] /= length;
    return length;
}

// Three-vectors and right-handed frames for the ray tracer.
#pragma once

#include <math.h>

typedef struct Vec {
    float x, y, z;
} Vec;

static inline Vec vec(float x, float y, float z)
{
    return (Vec){x, y, z};
}

static inline Vec vec_add(Vec a, Vec b)
{
    return vec(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline Vec vec_sub(Vec a, Vec b)
{
    return vec(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline Vec vec_scale(Vec a, float s)
{
    return vec(a.x * s, a.y * s, a.z * s);
}

static inline Vec vec_mul(Vec a, Vec b)
{
    return vec(a.x * b.x, a.y * b.y, a.z * b.z);
}

static inline Vec vec_mad(Vec a, Vec b, float s) // a + s b
{
    return vec(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

static inline float vec_dot(Vec a, Vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec vec_cross(Vec a, Vec b)
{
    return vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline float vec_length(Vec a)
{
    return sqrtf(vec_dot(a, a));
}

static inline Vec vec_unit(Vec a)
{
    float n = vec_length(a);
    return n > 0.0f ? vec_scale(a, 1.0f / n) : vec(0, 0, 1);
}

static inline Vec vec_reflect(Vec d, Vec n) // d mirrored in the plane with unit normal n
{
    return vec_mad(d, n, -2.0f * vec_dot(d, n));
}

// Two unit vectors that complete n to a right-handed orthonormal frame.
static inline void vec_basis(Vec n, Vec *t, Vec *b)
{
    float s = n.z < 0.0f ? -1.0f : 1.0f, k = -1.0f / (s + n.z), m = n.x * n.y * k;
    *t = vec(1.0f + s * n.x * n.x * k, s * m, -s * n.x);
    *b = vec(m, s + n.y * n.y * k, -n.y);
}

// Where an object stands: x right, y away from who looks at it, z up; always right-handed.
typedef struct Frame {
    Vec o, x, y, z;
} Frame;

static inline Frame frame_identity(void)
{
    return (Frame){vec(0, 0, 0), vec(1, 0, 0), vec(0, 1, 0), vec(0, 0, 1)};
}

static inline Vec frame_vector(Frame f, Vec v)
{
    return vec_add(vec_add(vec_scale(f.x, v.x), vec_scale(f.y, v.y)), vec_scale(f.z, v.z));
}

static inline Vec frame_point(Frame f, Vec p)
{
    return vec_add(f.o, frame_vector(f, p));
}

// A frame at p of f, turned by yaw (radians) about f's z.
static inline Frame frame_at(Frame f, Vec p, float yaw)
{
    float c = cosf(yaw), s = sinf(yaw);
    return (Frame){frame_point(f, p), vec_add(vec_scale(f.x, c), vec_scale(f.y, s)),
                   vec_add(vec_scale(f.x, -s), vec_scale(f.y, c)), f.z};
}

// The same turned about its own x by pitch (positive leans the top away), e.g. a picture that leans on a wall.
static inline Frame frame_pitch(Frame f, float pitch)
{
    float c = cosf(pitch), s = sinf(pitch);
    return (Frame){f.o, f.x, vec_add(vec_scale(f.y, c), vec_scale(f.z, -s)),
                   vec_add(vec_scale(f.y, s), vec_scale(f.z, c))};
}

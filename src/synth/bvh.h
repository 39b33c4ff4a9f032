// A bounding volume hierarchy over parallelograms and triangles, four children to a node.
#pragma once

#include <stdbool.h>

#include "synth/vec.h"

// Points corner + a edge_a + b edge_b with a, b in 0..1 (and a + b <= 1 for a triangle).
typedef struct PrimShape {
    Vec corner, edge_a, edge_b;
    int number; // in the world's order
    unsigned char triangle, flags;
} PrimShape;
enum { SHAPE_THIN = 1, SHAPE_GLOW = 2 }; // kinds that shadow rays may ignore

typedef float Four __attribute__((vector_size(16)));

// Four children at a time, their boxes side by side so that one instruction tests all four.
typedef struct BvhNode {
    Four low[3], high[3]; // a point at infinity where there is no child
    int first[4];         // of a leaf: its first shape; else the child's node
    int count[4];         // shapes of a leaf, 0 for a node
} BvhNode;

typedef struct Bvh {
    BvhNode *node;
    PrimShape *shape; // sorted into leaves
    int n_nodes, n;
} Bvh;

typedef struct Hit {
    float t, a, b;
    int prim; // world's number
} Hit;

int fs_bvh_build(Bvh *bvh, const PrimShape *shape, int n); // negative: out of memory
void fs_bvh_free(Bvh *bvh);
// Nearest hit with t in (0, hit->t); fills hit. d need not have unit length.
bool fs_bvh_hit(const Bvh *bvh, Vec o, Vec d, Hit *hit);
// One shape alone; hit->t and prim as above.
bool fs_bvh_hit_shape(const PrimShape *shape, Vec o, Vec d, Hit *hit);
// Anything in t in (t_min, t_max), but for shapes with a flag of ignore?
bool fs_bvh_blocked(const Bvh *bvh, Vec o, Vec d, float t_min, float t_max, int ignore);

// A person who stands in the mirrored room: a few ellipsoids, not part of a world, so that each photo has its own.
#pragma once

#include <stdbool.h>

#include "synth/vec.h"

typedef struct Figure {
    Vec feet, right, front; // unit vectors; up is z
    float size;             // 1: 1.72 m
    Vec skin, cloth, legs;  // albedo
    bool lit;               // the flash reaches it
} Figure;

typedef struct FigureHit {
    float t;
    Vec normal, albedo;
    const Figure *figure; // NULL: none
} FigureHit;

// Meets one of the figures nearer than hit->t, which says where then. d has unit length.
void fs_figure_hit(const Figure *figure, int n, Vec o, Vec d, FigureHit *hit);

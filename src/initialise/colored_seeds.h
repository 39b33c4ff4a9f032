// Both scenes as seeds with colours: from the points of each kind, by the flash's light on them.
#ifndef FS_INITIALISE_COLORED_SEEDS_H
#define FS_INITIALISE_COLORED_SEEDS_H

#include "initialise/stereo.h"
#include "initialise/light.h"
#include "initialise/first_colors.h"

typedef struct Material { // borrowed
    int n;
    const float *xyz; // (n, 3)
    const Cue *cue;
    const unsigned char *kind;
    const DensePoints *dense[2]; // transmitted, reflected: more points, without cues
} Material;

typedef struct ColoredSeeds {
    Seeds T, R;
    float *T_N, *T_F, *R_color; // linear, (n, 3)
    float *gain, *alpha;        // of the transmitted seeds: (n, 1) logarithm, (n, 3)
} ColoredSeeds;

int fs_colored_seeds_make(const Frames *frames, const Material *points, const FlashLight *light, int count,
                          uint64_t seed, Threads *threads, ColoredSeeds *painted, FsError *err);
void fs_colored_seeds_free(ColoredSeeds *painted);

#endif

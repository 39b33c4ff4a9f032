// The first colours: what of the photos' light belongs to the transmitted scene, what to the mirrored one.
#ifndef FS_INITIALISE_FIRST_COLORS_H
#define FS_INITIALISE_FIRST_COLORS_H

#include "base/arena.h"
#include "initialise/seeds.h"

typedef struct ColoredSeeds {
    Seeds T, R;
    float *T_N, *T_F, *R_color; // linear, (n, 3)
    float *gain, *alpha;        // the flash's at the transmitted seeds: (n, 1) logarithm, (n, 3)
    Arena arena;                // of the colours
} ColoredSeeds;

// From the seeds and alpha: T_N, T_F, R_color; none negative, and T + R about the photos. gain, which was alpha's, then
// is that of T_F / T_N.
int fs_first_colors_find(const SmallViews *views, ColoredSeeds *seeds, Threads *threads, FsError *err);

// The photos' own colours instead, of both lightings and whatever else is seen at a seed, as points of a dense cloud
// have them: what the published program begins with.
int fs_first_colors_of_photos(const SmallViews *views, ColoredSeeds *seeds, Threads *threads, FsError *err);

// The photos less one scene: seeds with their colours in photos without and with flash. `residual` gets copies of the
// cameras and photos; the rest of `views` is the same.
int fs_first_colors_subtract(const SmallViews *views, const Seeds *seeds, const float *without, const float *with,
                             SmallViews *residual, Threads *threads, FsError *err);

#endif

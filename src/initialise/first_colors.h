// The first colours: what of the photos' light belongs to the transmitted scene, what to the mirrored one.
#ifndef FS_INITIALISE_FIRST_COLORS_H
#define FS_INITIALISE_FIRST_COLORS_H

#include "initialise/seeds.h"

// alpha (T->n, 3): the flash's gain at each transmitted seed. Writes linear colours T_N, T_F (T->n, 3), R (R->n, 3);
// none negative, and T + R about the photos.
int fs_first_colors_find(const Frames *frames, const Seeds *T, const Seeds *R, const float *alpha, float *T_N,
                         float *T_F, float *R_color, Threads *threads, FsError *err);

// The photos less one scene: seeds with their colours in photos without and with flash. `freed` gets copies of the
// cameras and photos; the rest of `frames` is the same.
int fs_first_colors_subtract(const Frames *frames, const Seeds *seeds, const float *without, const float *with,
                             Frames *freed, Threads *threads, FsError *err);

#endif

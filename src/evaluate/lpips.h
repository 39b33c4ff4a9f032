// LPIPS (Zhang et al. 2018, version 0.1): distance of two pictures in the features of a trained network.
// Weights come from a file that the user makes; docs/lpips.md has the formula and the format.
#pragma once

#include "base/threads.h"
#include "image/image.h"

typedef enum LpipsNet { LPIPS_ALEX, LPIPS_VGG, LPIPS_NETS } LpipsNet;

typedef struct Lpips Lpips;

// FS_ERR_INPUT names what of the file is not as docs/lpips.md has it.
int fs_lpips_read(Lpips **lpips, const char *path, FsError *err);
void fs_lpips_free(Lpips *lpips);                    // accepts NULL
bool fs_lpips_has(const Lpips *lpips, LpipsNet net); // of a file; NULL has none
// a, b: tone-mapped RGB of one size, 0..1. NAN where they are too small for the network.
int fs_lpips_distance(const Lpips *lpips, LpipsNet net, const Image *a, const Image *b, Threads *threads, double *value,
                      FsError *err);

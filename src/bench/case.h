// One thing to time. bench.c has the table of all.
#pragma once

#include "base/threads.h"
#include "bench/result.h"
#include "kernels/kernels.h"

typedef struct BenchMachine {
    Kernels kernels;
    Threads *threads;
} BenchMachine;

typedef struct BenchCase {
    const char *name; // "photometric/300x200"
    const char *unit; // "value", "pair", ...
    // Makes the input (always the same) for n things at width x height; `wanted` is the case's own.
    void *(*open)(const BenchMachine *machine, const struct BenchCase *what); // NULL: out of memory
    BenchWork (*call)(void *state);
    void (*close)(void *state);
    int n, width, height;
    double wanted;
} BenchCase;

// case_image.c: the image-space kernels, one thread
void *fs_case_image_open(const BenchMachine *machine, const BenchCase *what);
void fs_case_image_close(void *state);
BenchWork fs_case_image_compose_forward(void *state);
BenchWork fs_case_image_compose_backward(void *state);
BenchWork fs_case_image_photometric(void *state);
BenchWork fs_case_image_pearson(void *state);
BenchWork fs_case_image_smooth(void *state);

// case_adam.c: one thread, n Gaussians' means
void *fs_case_adam_open(const BenchMachine *machine, const BenchCase *what); // wanted: share of visible Gaussians
void fs_case_adam_close(void *state);
BenchWork fs_case_adam_call(void *state);

// case_splats.c: generated clouds of n Gaussians, all threads
void *fs_case_splats_open(const BenchMachine *machine, const BenchCase *what); // wanted: pairs
void fs_case_splats_close(void *state);
BenchWork fs_case_splats_forward(void *state);  // project, sort, list, raster
BenchWork fs_case_splats_backward(void *state); // raster, reduce, project
BenchWork fs_case_splats_raster(void *state);   // both
BenchWork fs_case_splats_step(void *state);     // forward, L1 and SSIM, backward, Adam: a whole training step

// case_train.c: two steps of a real training, one at a flash photo, of two clouds of n Gaussians each, all threads
void *fs_case_train_open(const BenchMachine *machine, const BenchCase *what);
void fs_case_train_close(void *state);
BenchWork fs_case_train_call(void *state);

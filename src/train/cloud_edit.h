// Edits of a cloud in host memory, which remember where each row's moments come from (engine.h: CloudEdit).
#ifndef FS_TRAIN_CLOUD_EDIT_H
#define FS_TRAIN_CLOUD_EDIT_H

#include <math.h>

#include "base/rng.h"
#include "base/threads.h"
#include "engine/engine.h"

typedef struct Edit {
    Cloud *cloud;
    int *from; // (capacity of at least cloud->n) row of the moments, -1: none
    int capacity;
    unsigned forget; // bits 1 << CloudField
} Edit;

int fs_cloud_edit_begin(Edit *edit, Cloud *cloud, FsError *err); // cloud is borrowed and changed in place
void fs_cloud_edit_free(Edit *edit);
int fs_cloud_edit_append(Edit *edit, int n, FsError *err);         // n rows, zeroed, without moments
void fs_cloud_edit_copy(Edit *edit, int to, int from);             // parameters only
void fs_cloud_edit_compact(Edit *edit, const unsigned char *keep); // keep (N): drops the rows with 0

// densify.c: dead Gaussians of a cloud move beside live ones, and the cloud grows to `grown` (at least its size).
// Negative with FS_ERR_NUMERIC when all are dead.
int fs_densify_relocate(Edit *edit, int grown, const float *screen, Rng *rng, FsError *err);

// fsgs.c: the paper's densification, for a cloud of a scene of this extent. screen: mean screen-space gradients (N).
typedef struct FsgsArgs {
    const float *screen;
    double extent;
    int max_splats, step;
    Threads *threads;
} FsgsArgs;
int fs_fsgs_densify(Edit *edit, const FsgsArgs *args, Rng *rng, FsError *err);

static inline float fs_cloud_edit_sigmoid(float x)
{
    return 1 / (1 + expf(-x));
}
static inline float fs_cloud_edit_logit(float p)
{
    return logf(p / (1 - p));
}

#endif

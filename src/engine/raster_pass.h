// Rasterises clouds: projection, depth order, forward, backward, gradients per Gaussian. There are two rasterisers: by
// tiles, on all threads (raster_tiles.c), and plainly, as the definition reads (raster_plain.c).
#ifndef FS_ENGINE_RASTER_PASS_H
#define FS_ENGINE_RASTER_PASS_H

#include "base/arena.h"
#include "base/threads.h"
#include "kernels/kernels.h"
#include "kernels/planes.h"
#include "model/camera.h"
#include "model/cloud.h"
#include "model/radiance.h"

// One cloud, or one volume of radiance fields, at one camera. Zero it once, set the inputs before each forward; memory
// is kept from step to step.
typedef struct RasterTask {
    // inputs
    const Cloud *cloud;
    Volume volume;           // of fields: in place of the cloud,
    int first;               // and the first of its channels that is wanted
    const ShadeLight *light; // not NULL: colours as lit by the flash
    int colors;              // colour channels to render: the cloud's width of CLOUD_COLORS (3 with light)
    bool depth, cover;       // also render z, or the covers (not both), as the last feature
    bool median;             // of z not the weighted sum but where half of the light is stopped; not with train
    bool train;              // keep what backward needs
    bool count;              // count pairs
    // results of forward: alpha-weighted sums over splats, and what light passes all of them
    Planes feature;       // fs_raster_pass_features channels
    Planes transmittance; // 1 channel
    Planes way;           // of fields that train: disparity of depth as found from the near end, from the far end;
                          // VolumeKernels.spread
    long pairs;           // (pixel, splat) pairs that contributed, if asked to count, else 0
    int n_visible;
    // for backward: gradients of the loss with respect to `feature` and, if used, `transmittance`; the caller fills
    Planes d_feature, d_transmittance;
    Planes d_way; // zero, to be added to
    bool use_d_transmittance;
    // results of backward, for the cloud's n Gaussians; zero for those not seen
    float *d_field[CLOUD_FIELDS]; // like Cloud.field
    float *d_screen;     // (N) length of the gradient with respect to the mean in NDC units (3DGS densification)
    unsigned char *seen; // (N)
    double d_tint[3];    // with light: gradient of its tint

    // scratch
    Arena arena;
    struct RasterWork *work;
} RasterTask;

// Several clouds go through the phases together, so that all threads stay busy.
enum { RASTER_TASKS_MAX = 8 };
typedef struct RasterPass {
    const Kernels *kernels;
    Threads *threads;
    RasterTask *task[RASTER_TASKS_MAX];
    int n;
    const Camera *camera;
    float near;                  // near plane, world units
    struct VolumesWork *volumes; // of scenes of fields (raster_volumes.h)
    uint64_t jitter;             // VolumeMarch
    int every;                   // likewise; 0: 1
    bool blind;                  // colours are taken to be the same from everywhere
    int stride[2];               // of a photo, the camera has only every so many-th column and row; 0: 1
} RasterPass;

typedef struct Rasteriser {
    int (*forward)(const RasterPass *pass, FsError *err); // out of memory, or more tile entries than can be numbered
    void (*backward)(const RasterPass *pass);
} Rasteriser;

// Results do not depend on the number of threads.
extern const Rasteriser fs_raster_tiles, fs_raster_plain;

static inline int fs_raster_pass_features(const RasterTask *task)
{
    return task->colors + (task->depth || task->cover);
}
void fs_raster_pass_add(RasterPass *pass, RasterTask *task); // at most RASTER_TASKS_MAX
void fs_raster_pass_free_task(RasterTask *task);

// ---- what both rasterisers do per Gaussian ----

typedef struct RasterWork {
    ProjectCamera camera;
    int n;
    Splat *splats; // (n)
    float *shaded; // (n, 3) with light
    float *moment; // (n, FS_RECORD) sums of gradient records
    float *d_shaded, *d_depth;
    double (*chunk_tint)[3];
    int chunks;
    struct TileLists *tiles; // raster_tiles.c
    const TileEntry *entry;  // raster_plain.c: of every tile, and a tile's gradient records
    float *records;
} RasterWork;

enum { RASTER_CHUNK = 1024 };                                    // Gaussians per job
int fs_raster_pass_chunk_end(const RasterWork *work, int chunk); // of its Gaussians, behind the last
// Memory for a pass from the task's arena; check arena.failed afterwards.
void fs_raster_pass_set_up(RasterTask *task, const RasterPass *pass);
void fs_raster_pass_project(RasterTask *task, const Kernels *kernels, int chunk);   // fills splats and `seen`
void fs_raster_pass_gradients(RasterTask *task, const Kernels *kernels, int chunk); // from moments to d_field, d_screen
void fs_raster_pass_sum_tint(RasterTask *task);

// A tile's pixels between the arrays of the kernels and the planes.
void fs_raster_pass_tile_forward(const Kernels *kernels, RasterTask *task, const RasterTile *tile, long *pairs);
void fs_raster_pass_tile_backward(const Kernels *kernels, RasterTask *task, const RasterTile *tile, float *records);

#endif

// Rasterises clouds: projection, depth sort, tile lists, forward, backward, gradients per Gaussian. Several clouds go
// through the phases together, so that all threads stay busy; results do not depend on the number of threads.
#ifndef FS_ENGINE_RASTER_TASK_H
#define FS_ENGINE_RASTER_TASK_H

#include "base/arena.h"
#include "base/threads.h"
#include "kernels/kernels.h"
#include "kernels/planes.h"
#include "model/camera.h"
#include "model/cloud.h"

// One cloud at one camera. Zero it once, set the inputs before each forward; memory is kept from step to step.
typedef struct RasterTask {
    // inputs
    const Cloud *cloud;
    const ShadeLight *light; // not NULL: colours as lit by the flash (cloud has gains)
    int colors;              // colour channels to render: the cloud's width of CLOUD_COLORS
    bool depth;              // also render z, as the last feature
    bool train;              // keep what backward needs
    bool count;              // count pairs
    // results of forward: alpha-weighted sums over splats, and what light passes all of them
    Planes feature;       // colors (+ 1) channels
    Planes transmittance; // 1 channel
    long pairs;           // (pixel, splat) pairs that contributed, if asked to count, else 0
    int n_visible;
    // for backward: gradients of the loss with respect to `feature` and, if used, `transmittance`; the caller fills
    Planes d_feature, d_transmittance;
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

void fs_raster_task_forward(const Kernels *kernels, Threads *threads, RasterTask *const *task, int n,
                            const Camera *camera, float near);
void fs_raster_task_backward(const Kernels *kernels, Threads *threads, RasterTask *const *task, int n);
void fs_raster_task_free(RasterTask *task);

#endif

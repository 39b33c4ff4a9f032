// The image equation at one view, wired once for training and rendering: from what was rasterised to the photo,
//
//   I = encode(tau * decode(T) + beta * decode(R) + veil)   (kernels/compose.h),
//   P = what the camera makes of I                          (kernels/calibration.h),
//
// and back. In strips of rows, so that many threads can share the work.
#ifndef FS_ENGINE_VIEW_IMAGES_H
#define FS_ENGINE_VIEW_IMAGES_H

#include "engine/raster_pass.h"
#include "engine/view_plan.h"

typedef struct ViewImages {
    const Kernels *kernels;
    ViewPlan plan;
    RasterTask *T, *R, *beta; // R, beta: NULL where the view has none
    RasterTask *cover;        // that renders T's covers; NULL: there are none
    // forward, (channels, h, w)
    Planes beta_map, tau, T_linear, R_linear, I_linear, I; // 1, 1, 3, 3, 3, 3
    Planes black;                                          // 3, R where there is none
    Planes P; // 3, what the camera makes of I (kernels/calibration.h); I itself where it shows light as it is
    // backward
    Planes d_P, d_I, d_beta, d_tau, d_black, d_veil;
    float slope_floor;      // kernels/compose.h
    const float *occlusion; // who stands in the mirrored light's way (kernels/occlusion.h); NULL: nobody
    Planes beta_clear;      // 1, beta_map without them,
    Planes beta_open;       // 1, and without covers
    const float *texture;   // of the veil, seen as `veil_view` says; NULL: there is none
    VeilView veil_view;
    Planes veil; // 3
} ViewImages;

// Plan and tasks are set; planes come from the arena (check arena->failed). train: with those of backward.
void fs_view_images_set_up(ViewImages *images, const Kernels *kernels, Arena *arena, const Camera *camera, bool train);
void fs_view_images_forward(const ViewImages *images, int y0, int y1);
// From d_P to the tasks' d_feature, d_beta and d_tau, and to the calibration's gradient, all added to: zero them first.
void fs_view_images_backward(const ViewImages *images, int y0, int y1, CalibrationGradient *gradient);
// From d_beta and d_tau, complete, to the pane (returned) or the beta task's d_feature.
// d_q: dL/d occlusion, added to.
PaneGradient fs_view_images_backward_beta(const ViewImages *images, int y0, int y1, float *d_q);
void fs_view_images_zero(const ViewImages *images, int y0, int y1); // what backward adds to

static inline Planes fs_view_images_rgb(const Planes *feature) // without what comes after it
{
    Planes p = *feature;
    p.channels = 3;
    return p;
}
// Depth or covers, whichever is rendered.
static inline Planes fs_view_images_last(const RasterTask *task, const Planes *feature)
{
    Planes p = *feature;
    p.px = fs_planes_row(feature, task->colors, 0);
    p.channels = 1;
    return p;
}

#endif

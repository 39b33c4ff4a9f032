// What the terms of the loss (engine/loss.h) look at.
#ifndef FS_ENGINE_VIEW_LOSS_H
#define FS_ENGINE_VIEW_LOSS_H

#include "engine/loss.h"
#include "engine/view_images.h"

// A view of a photo, for terms on images. Gradients are added to (opaque's: written) where the kernels say.
typedef struct ViewLoss {
    const Kernels *kernels;
    const double *weight; // (LOSS_TERMS)
    const ViewImages *images;
    RasterTask *task[LAYERS];              // by the layer whose cloud it renders; NULL: not in this view
    const Planes *photo, *mu, *var;        // of the photo, tone-mapped, and its windows (kernels/photometric.h)
    const Planes *mask;                    // weight of each pixel in this step
    const RasterTask *other;               // the T of the other lighting, for terms on both; NULL: none
    const float *around;                   // of R where somebody hides it (kernels/occlusion.h); NULL: nobody does
    const Planes *T_linear, *other_linear; // both decoded, where there is the other
    const PearsonSums *pearson;            // of the whole image
    void *scratch;                         // of this thread, for kernels->photometric
} ViewLoss;

// A range of a cloud's Gaussians, for terms on parameters.
typedef struct CloudLoss {
    const Kernels *kernels;
    const double *weight;
    const Scene *scene;
    const Cloud *cloud;
    const GainGraph *graph; // of the transmitted cloud's gains; NULL: none is known
    float *const *d_field;  // added to
    int begin, end;
} CloudLoss;

#endif

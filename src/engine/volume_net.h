// The networks of a volume of a radiance field on samples, forward and back. Samples lie side by side: an array of f
// features is (f, stride).
#ifndef FS_ENGINE_VOLUME_NET_H
#define FS_ENGINE_VOLUME_NET_H

#include "engine/volume_march.h"
#include "kernels/kernels.h"

typedef struct VolumeNet {
    const Kernels *kernels;
    const RadianceShape *shape;
    const float *table;
    RadianceLevel level[RADIANCE_LEVELS_MOST];
    MlpLayer layer[RADIANCE_LEARNED]; // of the parts that are matrices; without stride
    int color_rows;
    float thin;         // added to the logarithm of a sample's optical thickness
    float parts, apart; // disparity from where on less is added; by the slope 1 / apart
    float beta;         // added to the logit of beta
} VolumeNet;

// Samples of some rays. Those that weigh nothing have no colours: `of` says which have.
typedef struct VolumeSamples {
    int n, kept;
    size_t stride, kept_stride; // n and kept, padded
    VolumePlaces places;
    float *tau, *w, *w_far, *d_tau;
    float *code, *hidden, *body; // (features of all levels), (hidden), (RADIANCE_BODY_WIDTH); code gets its gradient
    int *of;                     // (kept)
    float *input, *hidden_1, *hidden_2, *color; // of those kept; color: (color_rows + 1), the last row beta
} VolumeSamples;

VolumeNet fs_volume_net(const Kernels *kernels, const Radiance *field, Volume volume, int every); // VolumeMarch
size_t fs_volume_net_stride(int n); // floats of a row of n samples, padded as the kernels want
size_t fs_volume_net_floats(const RadianceShape *shape, size_t stride); // for samples of that stride
// Arrays for n samples in memory of that many floats, 64-byte aligned.
VolumeSamples fs_volume_net_samples(const RadianceShape *shape, int n, float *memory);

void fs_volume_net_density(const VolumeNet *net, VolumeSamples *samples); // from places to tau
// From body and the last RADIANCE_DIRECTION rows of input to color, of the samples in `of`.
void fs_volume_net_color(const VolumeNet *net, VolumeSamples *samples);

// From d_color (like color) and samples->d_tau to gradients of the matrices, added to d_part, and of the code, which
// takes its place. scratch: for each sample twice hidden and RADIANCE_BODY_WIDTH and once RADIANCE_DIRECTION floats.
void fs_volume_net_backward(const VolumeNet *net, VolumeSamples *samples, float *d_color,
                            float *const d_part[RADIANCE_LEARNED], float *scratch);

#endif

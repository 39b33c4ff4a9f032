#include "engine/volume_net.h"

#include <math.h>
#include <string.h>

_Static_assert((int)FS_HASHGRID_FEATURES == (int)RADIANCE_FEATURES, "a row of a table is what the kernel takes");

// Added to the logarithm of a step's optical thickness, so that fields begin as thin fog. Of two fields, T begins in
// the near half of what there is and R in the far one: photos hardly tell which scene is which, and of fog that is both
// each takes some colours.
#define THIN -5.5f
#define THIN_R -4.0f     // which has less room
#define ELSEWHERE -6.0f  // for T among what is far, R among what is near
#define APART 0.1f       // of disparity, over which that sets in
#define FIRST_BETA -1.5f // logit: light is T's at first

VolumeNet fs_volume_net(const Kernels *kernels, const Radiance *field, Volume volume, int every)
{
    const RadianceShape *s = &field->shape;
    const int code = s->levels * RADIANCE_FEATURES, colors = fs_radiance_color_rows(s, volume);
    VolumeNet net = {.kernels = kernels,
                     .shape = s,
                     .table = fs_radiance_part(field, volume, RADIANCE_TABLE),
                     .color_rows = colors,
                     .thin = (volume == VOLUME_R ? THIN_R : THIN) + logf((float)every)};
    if (s->colors[VOLUME_R]) {
        net.parts = (float)field->frame.parts;
        net.apart = (volume == VOLUME_R ? -1 : 1) / APART;
        net.beta = FIRST_BETA;
    }
    for (int l = 0; l < s->levels; l++) net.level[l] = fs_radiance_level(s, l);
    const int size[RADIANCE_LEARNED][2] = {{0, 0},
                                           {s->hidden, code},
                                           {RADIANCE_BODY_WIDTH, s->hidden},
                                           {s->hidden, RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION},
                                           {s->hidden, s->hidden},
                                           {colors, s->hidden}};
    for (int p = RADIANCE_DENSITY; p < RADIANCE_LEARNED; p++)
        net.layer[p] = (MlpLayer){fs_radiance_part(field, volume, (RadiancePart)p), size[p][0], size[p][1], 0};
    return net;
}

static MlpLayer layer_of(const VolumeNet *net, RadiancePart part, size_t stride)
{
    MlpLayer layer = net->layer[part];
    layer.stride = stride;
    return layer;
}

static HashLevel hash_level(const RadianceLevel *l)
{
    return (HashLevel){l->resolution, l->rows, l->hashed};
}

// ---- memory ----

size_t fs_volume_net_stride(int n)
{
    return ((size_t)n + FS_MLP_PAD - 1) / FS_MLP_PAD * FS_MLP_PAD;
}

static int rows_of_all(const RadianceShape *s)
{
    return 9 + s->levels * RADIANCE_FEATURES + s->hidden + RADIANCE_BODY_WIDTH + 1 + RADIANCE_BODY_WIDTH +
           RADIANCE_DIRECTION + 2 * s->hidden + RADIANCE_COLORS_MOST + 3;
}

size_t fs_volume_net_floats(const RadianceShape *shape, size_t stride)
{
    return stride * (size_t)rows_of_all(shape);
}

static float *take(float **memory, int rows, size_t stride)
{
    float *taken = *memory;
    *memory += (size_t)rows * stride;
    return taken;
}

VolumeSamples fs_volume_net_samples(const RadianceShape *s, int n, float *memory)
{
    VolumeSamples v = {.n = n, .stride = fs_volume_net_stride(n)};
    float **one[] = {&v.places.at[0], &v.places.at[1], &v.places.at[2], &v.places.z, &v.places.s, &v.tau, &v.w,
                     &v.w_far,        &v.d_tau};
    for (size_t i = 0; i < sizeof one / sizeof *one; i++) *one[i] = take(&memory, 1, v.stride);
    v.code = take(&memory, s->levels * RADIANCE_FEATURES, v.stride);
    v.hidden = take(&memory, s->hidden, v.stride);
    v.body = take(&memory, RADIANCE_BODY_WIDTH, v.stride);
    v.of = (int *)(void *)take(&memory, 1, v.stride);
    v.input = take(&memory, RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION, v.stride);
    v.hidden_1 = take(&memory, s->hidden, v.stride);
    v.hidden_2 = take(&memory, s->hidden, v.stride);
    v.color = take(&memory, RADIANCE_COLORS_MOST + 3, v.stride);
    for (int k = 0; k < 3; k++) memset(v.places.at[k] + n, 0, (v.stride - (size_t)n) * sizeof(float));
    return v;
}

// ---- forward ----

void fs_volume_net_density(const VolumeNet *net, VolumeSamples *v)
{
    const MlpKernels *mlp = net->kernels->mlp;
    const HashPlaces places = {{v->places.at[0], v->places.at[1], v->places.at[2]}, (int)v->stride};
    for (int l = 0; l < net->shape->levels; l++) {
        HashLevel level = hash_level(&net->level[l]);
        net->kernels->hashgrid->encode(&level, net->table + RADIANCE_FEATURES * net->level[l].first, &places,
                                       v->code + (size_t)(RADIANCE_FEATURES * l) * v->stride, v->stride);
    }
    MlpLayer density = layer_of(net, RADIANCE_DENSITY, v->stride), body = layer_of(net, RADIANCE_BODY, v->stride);
    mlp->forward(&density, true, v->code, v->hidden);
    mlp->forward(&body, false, v->hidden, v->body);
    for (size_t i = 0; i < v->stride; i++) {
        float past = (v->places.at[2][i] - net->parts) * net->apart;
        v->body[i] += net->thin + ELSEWHERE * (past < 0 ? 0 : past > 1 ? 1 : past);
        v->body[v->stride + i] += net->beta;
    }
    net->kernels->volume->thickness(v->body, v->n, v->tau);
}

static void sigmoid_row(const VolumeNet *net, const float *logit, float *out, size_t n)
{
    Planes from = fs_planes_over((float *)logit, (int)n, 1, 1), to = fs_planes_over(out, (int)n, 1, 1);
    net->kernels->pixelwise->sigmoid(&from, &to, 0, 1);
}

void fs_volume_net_color(const VolumeNet *net, VolumeSamples *v)
{
    const MlpKernels *mlp = net->kernels->mlp;
    const size_t stride = v->kept_stride = fs_volume_net_stride(v->kept);
    for (int r = 0; r < RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION; r++) {
        float *row = v->input + (size_t)r * stride;
        for (int i = 0; i < v->kept && r < RADIANCE_BODY_WIDTH; i++)
            row[i] = v->body[(size_t)r * v->stride + (size_t)v->of[i]];
        memset(row + v->kept, 0, (stride - (size_t)v->kept) * sizeof *row);
    }
    MlpLayer first = layer_of(net, RADIANCE_COLOR_1, stride), second = layer_of(net, RADIANCE_COLOR_2, stride),
             third = layer_of(net, RADIANCE_COLOR_3, stride);
    mlp->forward(&first, true, v->input, v->hidden_1);
    mlp->forward(&second, true, v->hidden_1, v->hidden_2);
    mlp->forward(&third, false, v->hidden_2, v->color);
    for (int c = 0; c < net->color_rows; c++)
        sigmoid_row(net, v->color + (size_t)c * stride, v->color + (size_t)c * stride, stride);
    sigmoid_row(net, v->input + stride, v->color + (size_t)net->color_rows * stride, stride); // beta: row 1 of the body
}

// ---- back ----

static void layer_back(const VolumeNet *net, const MlpLayer *layer, const float *d_y, const float *x, bool rectified,
                       float *d_x, float *d_w)
{
    net->kernels->mlp->weights(layer, d_y, x, d_w);
    net->kernels->mlp->back(layer, d_y, rectified ? x : NULL, d_x);
}

// From the colours to d_body, which is written. d_color's rows become those of their logits.
static void color_back(const VolumeNet *net, const VolumeSamples *v, float *d_color, float *const d_part[],
                       float *d_body, float *scratch)
{
    const size_t stride = v->kept_stride;
    const RadianceShape *s = net->shape;
    float *d_2 = scratch, *d_1 = d_2 + (size_t)s->hidden * stride, *d_input = d_1 + (size_t)s->hidden * stride;
    for (int c = 0; c <= net->color_rows; c++) {
        size_t at = (size_t)c * stride;
        Planes x = fs_planes_over(v->color + at, (int)stride, 1, 1),
               d = fs_planes_over(d_color + at, (int)stride, 1, 1);
        net->kernels->pixelwise->sigmoid_backward(&x, &d, &d, 0, 1);
    }
    MlpLayer first = layer_of(net, RADIANCE_COLOR_1, stride), second = layer_of(net, RADIANCE_COLOR_2, stride),
             third = layer_of(net, RADIANCE_COLOR_3, stride);
    layer_back(net, &third, d_color, v->hidden_2, true, d_2, d_part[RADIANCE_COLOR_3]);
    layer_back(net, &second, d_2, v->hidden_1, true, d_1, d_part[RADIANCE_COLOR_2]);
    layer_back(net, &first, d_1, v->input, false, d_input, d_part[RADIANCE_COLOR_1]);
    const float *d_beta = d_color + (size_t)net->color_rows * stride;
    memset(d_body, 0, RADIANCE_BODY_WIDTH * v->stride * sizeof *d_body);
    for (int r = 0; r < RADIANCE_BODY_WIDTH; r++)
        for (int i = 0; i < v->kept; i++)
            d_body[(size_t)r * v->stride + (size_t)v->of[i]] =
                d_input[(size_t)r * stride + (size_t)i] + (r == 1 ? d_beta[i] : 0);
}

void fs_volume_net_backward(const VolumeNet *net, VolumeSamples *v, float *d_color,
                            float *const d_part[RADIANCE_LEARNED], float *scratch)
{
    const RadianceShape *s = net->shape;
    float *d_body = scratch, *rest = d_body + RADIANCE_BODY_WIDTH * v->stride, *d_hidden = rest;
    color_back(net, v, d_color, d_part, d_body, rest);
    float *d_logarithm = rest + (size_t)s->hidden * v->stride;
    net->kernels->volume->thickness_backward(v->body, v->tau, v->d_tau, v->n, d_logarithm);
    for (int i = 0; i < v->n; i++) d_body[i] += d_logarithm[i];
    MlpLayer density = layer_of(net, RADIANCE_DENSITY, v->stride), body = layer_of(net, RADIANCE_BODY, v->stride);
    layer_back(net, &body, d_body, v->hidden, true, d_hidden, d_part[RADIANCE_BODY]);
    layer_back(net, &density, d_hidden, v->code, false, v->code, d_part[RADIANCE_DENSITY]);
}

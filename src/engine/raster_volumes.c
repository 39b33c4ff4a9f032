// Rays go in groups, which are jobs: march, density, weights, colours, sums; and back. Gradients of the networks are
// summed by group, in order; those of the tables by level, over all samples in order: results do not depend on the
// number of threads.
#include "engine/raster_volumes.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "engine/scratch.h"

#define WEIGHS 2e-4f // samples that weigh less have no colours
#define HIDDEN 1e-3f // of the light arrives: samples behind learn nothing, which saves time
enum { GROUP = 32, WAYS = 3, BETA = RADIANCE_COLORS_MOST, CHANNELS = RADIANCE_COLORS_MOST + 1 };

// What a ray of a volume shows; and its gradient.
typedef struct Pixel {
    float color[CHANNELS];          // the last is beta
    float z, passes, near_s, far_s; // depth; disparity from the near end and from the far end (NeRFReN, section 3.3)
    float spread;
} Pixel;

typedef struct RayGroup {
    VolumeSamples samples;
    int begin[GROUP + 1], kept[GROUP + 1]; // of each ray, among samples and among those kept
} RayGroup;

typedef struct VolumePass {
    const RasterPass *raster;
    VolumesWork *work;
    Volume volume;
    VolumeNet net;
    VolumeMarch march;
    RasterTask *task[RASTER_TASKS_MAX], *back[RASTER_TASKS_MAX]; // that show this volume; of those, that have gradients
    int n_tasks, n_back, rays, groups;
    bool train, median;
    RayGroup *group;   // (groups), where it trains
    float **scratch;   // by worker
    size_t *floats;    // of a group's samples
    float *d_networks; // (groups, networks)
    size_t networks;   // floats of the matrices
} VolumePass;

// ---- the engine's part ----

int fs_raster_volumes_open(VolumesWork *work, Radiance *field, FsError *err)
{
    *work = (VolumesWork){.field = field};
    for (int v = 0; v < VOLUMES; v++) {
        size_t n;
        fs_radiance_at(&field->shape, (Volume)v, RADIANCE_GRID, &n);
        if (!(work->occupied[v] = calloc(n / 32 + 1, sizeof(uint32_t)))) return fs_error_memory(err);
        if (n) fs_volume_march_occupied(field, (Volume)v, work->occupied[v]);
    }
    return 0;
}

int fs_raster_volumes_need_gradients(VolumesWork *work, FsError *err)
{
    if (work->grad) return 0;
    for (int v = 0; v < VOLUMES; v++) {
        size_t n;
        fs_radiance_at(&work->field->shape, (Volume)v, RADIANCE_TABLE, &n);
        free(work->touched[v]);
        if (!(work->touched[v] = calloc(n / RADIANCE_FEATURES + 1, 1))) return fs_error_memory(err);
    }
    return (work->grad = calloc(work->field->n, sizeof *work->grad)) ? 0 : fs_error_memory(err);
}

void fs_raster_volumes_close(VolumesWork *work)
{
    for (int v = 0; v < VOLUMES; v++) {
        free(work->occupied[v]);
        free(work->touched[v]);
    }
    free(work->grad);
    fs_arena_free(&work->arena);
    *work = (VolumesWork){0};
}

// ---- forward ----

static int rays_of(const VolumePass *p, int group)
{
    return (group + 1) * GROUP < p->rays ? GROUP : p->rays - group * GROUP;
}

static void march_group(const VolumePass *p, int group, const VolumePlaces *places, int begin[GROUP + 1])
{
    const int width = p->raster->camera->width;
    begin[0] = 0;
    for (int r = 0; r < rays_of(p, group); r++) {
        int ray = group * GROUP + r, at = begin[r];
        VolumePlaces from;
        if (places)
            from = (VolumePlaces){
                {places->at[0] + at, places->at[1] + at, places->at[2] + at}, places->z + at, places->s + at};
        begin[r + 1] = at + fs_volume_march_ray(&p->march, ray % width, ray / width, places ? &from : NULL);
    }
}

static void count_job(void *context, int group, int worker)
{
    (void)worker;
    const VolumePass *p = context;
    RayGroup *g = &p->group[group];
    march_group(p, group, NULL, g->begin);
    p->floats[group] = fs_volume_net_floats(p->net.shape, fs_volume_net_stride(g->begin[rays_of(p, group)]));
}

// Which samples have colours, and their rays' directions.
static void keep_samples(const VolumePass *p, int group, RayGroup *g)
{
    VolumeSamples *v = &g->samples;
    const int width = p->raster->camera->width, rays = rays_of(p, group);
    float direction[GROUP][RADIANCE_DIRECTION];
    v->kept = g->kept[0] = 0;
    for (int r = 0; r < rays; r++) {
        int ray = group * GROUP + r;
        for (int i = g->begin[r]; i < g->begin[r + 1]; i++)
            if (v->w[i] > WEIGHS) v->of[v->kept++] = i;
        g->kept[r + 1] = v->kept;
        fs_volume_march_direction(&p->march, ray % width, ray / width, direction[r]);
    }
    size_t stride = fs_volume_net_stride(v->kept);
    const bool looks = p->volume == VOLUME_T &&
                       !p->raster->blind; // the mirrored room looks the same from everywhere (NeRFReN, section 4)
    for (int d = 0; d < RADIANCE_DIRECTION; d++) {
        float *row = v->input + (size_t)(RADIANCE_BODY_WIDTH + d) * stride;
        for (int r = 0; r < rays; r++)
            for (int i = g->kept[r]; i < g->kept[r + 1]; i++) row[i] = looks ? direction[r][d] : 0;
    }
}

static VolumeBlend blend_of(const VolumePass *p, const RayGroup *g, int r, bool beta, int *of)
{
    const VolumeSamples *v = &g->samples;
    int first = g->kept[r], n = g->kept[r + 1] - first;
    for (int i = 0; i < n; i++) of[i] = v->of[first + i] - g->begin[r];
    const float *x = v->color + (beta ? (size_t)p->net.color_rows * v->kept_stride : 0) + first;
    return (VolumeBlend){v->w + g->begin[r], of, x, n, beta ? 1 : p->net.shape->colors[p->volume], (int)v->kept_stride};
}

static void show_ray(const VolumePass *p, int ray, const Pixel *pixel)
{
    const int width = p->raster->camera->width, x = ray % width, y = ray / width;
    for (int t = 0; t < p->n_tasks; t++) {
        const RasterTask *task = p->task[t];
        for (int c = 0; c < task->colors; c++) fs_planes_row(&task->feature, c, y)[x] = pixel->color[task->first + c];
        if (task->depth) fs_planes_row(&task->feature, task->colors, y)[x] = pixel->z;
        fs_planes_row(&task->transmittance, 0, y)[x] = pixel->passes;
        if (!task->train) continue;
        fs_planes_row(&task->way, 0, y)[x] = pixel->near_s;
        fs_planes_row(&task->way, 1, y)[x] = pixel->far_s;
        fs_planes_row(&task->way, 2, y)[x] = pixel->spread;
    }
}

static float step_of(const VolumePass *p)
{
    return (float)p->march.every / (float)p->march.samples;
}

static void sum_ray(const VolumePass *p, const RayGroup *g, int r, int ray)
{
    const VolumeSamples *v = &g->samples;
    const VolumeKernels *k = p->net.kernels->volume;
    int of[RADIANCE_SAMPLES_MOST];
    Pixel pixel = {.passes = 1};
    VolumeBlend colors = blend_of(p, g, r, false, of), beta = blend_of(p, g, r, true, of);
    k->blend(&colors, pixel.color);
    k->blend(&beta, pixel.color + BETA);
    for (int i = g->begin[r]; i < g->begin[r + 1]; i++) {
        bool falls = pixel.passes >= 0.5f && pixel.passes - v->w[i] < 0.5f;
        pixel.z += (p->median ? (float)falls : v->w[i]) * v->places.z[i];
        pixel.passes -= v->w[i];
        pixel.near_s += v->w[i] * v->places.s[i];
        if (p->train) pixel.far_s += v->w_far[i] * v->places.s[i];
    }
    int at = g->begin[r];
    if (p->train) pixel.spread = k->spread(v->w + at, v->places.s + at, g->begin[r + 1] - at, step_of(p));
    pixel.near_s += pixel.passes; // what passes all comes from the far end; from there, from the near one
    show_ray(p, ray, &pixel);
}

static void forward_group(const VolumePass *p, int group, RayGroup *g, float *memory)
{
    VolumeSamples *v = &g->samples;
    const VolumeKernels *k = p->net.kernels->volume;
    const int rays = rays_of(p, group);
    *v = fs_volume_net_samples(p->net.shape, g->begin[rays], memory);
    march_group(p, group, &v->places, g->begin);
    fs_volume_net_density(&p->net, v);
    for (int r = 0; r < rays; r++) {
        int at = g->begin[r], n = g->begin[r + 1] - at;
        k->weights(v->tau + at, n, false, v->w + at);
        if (p->train) k->weights(v->tau + at, n, true, v->w_far + at);
    }
    keep_samples(p, group, g);
    fs_volume_net_color(&p->net, v);
    for (int r = 0; r < rays; r++) sum_ray(p, g, r, group * GROUP + r);
}

static void render_job(void *context, int group, int worker)
{
    const VolumePass *p = context;
    RayGroup g;
    march_group(p, group, NULL, g.begin);
    forward_group(p, group, &g, p->scratch[worker]);
}

static void train_job(void *context, int group, int worker)
{
    (void)worker;
    const VolumePass *p = context;
    forward_group(p, group, &p->group[group], (float *)p->group[group].samples.places.at[0]);
}

static int workers_of(const RasterPass *pass)
{
    return pass->threads ? fs_threads_count(pass->threads) : 1;
}

static int allocate_scratch(VolumePass *p, size_t floats, FsError *err)
{
    Arena *arena = &p->work->arena;
    p->scratch = ARENA_NEW(arena, float *, workers_of(p->raster));
    for (int i = 0; i < workers_of(p->raster) && p->scratch; i++) p->scratch[i] = ARENA_NEW(arena, float, floats);
    return arena->failed ? fs_error_memory(err) : 0;
}

// Training keeps all samples: memory for as many as there are.
static int forward_training(VolumePass *p, FsError *err)
{
    Arena *arena = &p->work->arena;
    size_t most = 0;
    p->group = ARENA_NEW(arena, RayGroup, p->groups);
    p->floats = ARENA_NEW(arena, size_t, p->groups);
    if (arena->failed) return fs_error_memory(err);
    fs_threads_for(p->raster->threads, p->groups, count_job, p);
    for (int i = 0; i < p->groups; i++) {
        const RayGroup *g = &p->group[i];
        int n = g->begin[rays_of(p, i)];
        p->group[i].samples.places.at[0] = ARENA_NEW(arena, float, p->floats[i]);
        most = p->floats[i] > most ? p->floats[i] : most;
        p->work->samples[p->volume] += n;
    }
    p->work->rays = p->rays;
    p->networks = fs_radiance_at(p->net.shape, p->volume, RADIANCE_LEARNED, NULL) -
                  fs_radiance_at(p->net.shape, p->volume, RADIANCE_DENSITY, NULL);
    p->d_networks = ARENA_NEW(arena, float, p->networks *(size_t)p->groups);
    MUST(allocate_scratch(p, most, err)); // of backward, which takes less than a group's samples
    fs_threads_for(p->raster->threads, p->groups, train_job, p);
    return 0;
}

static int forward_volume(VolumePass *p, FsError *err)
{
    if (p->train) return forward_training(p, err);
    size_t stride = fs_volume_net_stride(GROUP * p->net.shape->samples);
    MUST(allocate_scratch(p, fs_volume_net_floats(p->net.shape, stride), err));
    fs_threads_for(p->raster->threads, p->groups, render_job, p);
    return 0;
}

static VolumePass *pass_of(const RasterPass *raster, Volume volume)
{
    VolumesWork *work = raster->volumes;
    const Camera *camera = raster->camera;
    const int every = raster->every > 1 ? raster->every : 1;
    VolumePass *p = ARENA_NEW(&work->arena, VolumePass, 1);
    if (!p) return NULL;
    *p = (VolumePass){.raster = raster,
                      .work = work,
                      .volume = volume,
                      .net = fs_volume_net(raster->kernels, work->field, volume, every),
                      .march = fs_volume_march(work->field, camera, work->occupied[volume], raster->jitter, every),
                      .rays = camera->width * camera->height};
    p->groups = (p->rays + GROUP - 1) / GROUP;
    for (int t = 0; t < raster->n; t++) {
        RasterTask *task = raster->task[t];
        if (task->volume != volume) continue;
        p->task[p->n_tasks++] = task;
        p->train |= task->train;
        p->median |= task->median;
    }
    return p;
}

static int set_up_task(RasterTask *task, const Camera *camera, FsError *err)
{
    Arena *a = &task->arena;
    fs_arena_reset(a);
    int channels = task->colors + task->depth;
    task->n_visible = 0;
    task->feature = fs_scratch_planes(a, camera, channels);
    task->transmittance = fs_scratch_planes(a, camera, 1);
    if (task->train) {
        task->d_feature = fs_scratch_planes(a, camera, channels);
        task->d_transmittance = fs_scratch_planes(a, camera, 1);
        task->way = fs_scratch_planes(a, camera, WAYS);
        task->d_way = fs_scratch_planes(a, camera, WAYS);
        if (!a->failed)
            memset(task->d_way.px, 0, sizeof(float) * fs_planes_floats(camera->width, camera->height, WAYS));
    }
    return a->failed ? fs_error_memory(err) : 0;
}

static int forward(const RasterPass *raster, FsError *err)
{
    VolumesWork *work = raster->volumes;
    if ((int64_t)raster->camera->width * raster->camera->height > INT_MAX - GROUP)
        return fs_error_set(err, FS_ERR_INPUT, "a picture of %d x %d pixels: radiance fields have at most %d million",
                            raster->camera->width, raster->camera->height, INT_MAX / 1000000);
    fs_arena_reset(&work->arena);
    work->rays = 0;
    for (int v = 0; v < VOLUMES; v++) work->samples[v] = 0;
    for (int t = 0; t < raster->n; t++) MUST(set_up_task(raster->task[t], raster->camera, err));
    for (int v = 0; v < VOLUMES; v++) {
        if (!(work->pass[v] = pass_of(raster, (Volume)v))) return fs_error_memory(err);
        if (work->pass[v]->n_tasks) MUST(forward_volume(work->pass[v], err));
    }
    return 0;
}

// ---- back ----

static void gather_pixel(const VolumePass *p, int ray, Pixel *d)
{
    const int width = p->raster->camera->width, x = ray % width, y = ray / width;
    *d = (Pixel){.passes = 0};
    for (int t = 0; t < p->n_back; t++) {
        const RasterTask *task = p->back[t];
        for (int c = 0; c < task->colors; c++) d->color[task->first + c] += fs_planes_row(&task->d_feature, c, y)[x];
        if (task->depth) d->z += fs_planes_row(&task->d_feature, task->colors, y)[x];
        if (task->use_d_transmittance) d->passes += fs_planes_row(&task->d_transmittance, 0, y)[x];
        d->near_s += fs_planes_row(&task->d_way, 0, y)[x];
        d->far_s += fs_planes_row(&task->d_way, 1, y)[x];
        d->spread += fs_planes_row(&task->d_way, 2, y)[x];
    }
    d->passes += d->near_s;
}

static void ray_back(const VolumePass *p, const RayGroup *g, int r, int ray, float *d_color)
{
    const VolumeSamples *v = &g->samples;
    const VolumeKernels *k = p->net.kernels->volume;
    int of[RADIANCE_SAMPLES_MOST], at = g->begin[r], n = g->begin[r + 1] - at;
    float d_w[RADIANCE_SAMPLES_MOST];
    Pixel d;
    gather_pixel(p, ray, &d);
    VolumeBlend colors = blend_of(p, g, r, false, of), beta = blend_of(p, g, r, true, of);
    for (int i = 0; i < n; i++) d_w[i] = d.z * v->places.z[at + i] + d.near_s * v->places.s[at + i];
    k->blend_backward(&colors, d.color, d_color + g->kept[r], d_w);
    k->blend_backward(&beta, d.color + BETA, d_color + (size_t)p->net.color_rows * v->kept_stride + g->kept[r], d_w);
    if (d.spread != 0) k->spread_backward(v->w + at, v->places.s + at, n, step_of(p), d.spread, d_w);
    k->weights_backward(v->w + at, n, false, d_w, d.passes, v->d_tau + at);
    float left = 1;
    for (int i = 0; i < n; i++) {
        if (left < HIDDEN) v->d_tau[at + i] = 0;
        left -= v->w[at + i];
    }
    if (d.far_s == 0) return;
    for (int i = 0; i < n; i++) d_w[i] = d.far_s * v->places.s[at + i];
    k->weights_backward(v->w_far + at, n, true, d_w, 0, v->d_tau + at);
}

static void backward_job(void *context, int group, int worker)
{
    const VolumePass *p = context;
    RayGroup *g = &p->group[group];
    VolumeSamples *v = &g->samples;
    float *d_color = p->scratch[worker], *scratch = d_color + (RADIANCE_COLORS_MOST + 3) * v->stride;
    float *d_part[RADIANCE_LEARNED], *d = p->d_networks + (size_t)group * p->networks;
    memset(d, 0, sizeof *d * p->networks);
    for (int part = RADIANCE_DENSITY; part < RADIANCE_LEARNED; part++) {
        d_part[part] = d;
        d += (size_t)p->net.layer[part].rows * (size_t)p->net.layer[part].columns;
    }
    memset(d_color, 0, sizeof(float) * (size_t)(p->net.color_rows + 1) * v->kept_stride);
    memset(v->d_tau, 0, sizeof(float) * v->stride);
    for (int r = 0; r < rays_of(p, group); r++) ray_back(p, g, r, group * GROUP + r, d_color);
    fs_volume_net_backward(&p->net, v, d_color, d_part, scratch);
}

static void level_job(void *context, int l, int worker)
{
    (void)worker;
    const VolumePass *p = context;
    const RadianceLevel *level = &p->net.level[l];
    const HashLevel hash = {level->resolution, level->rows, level->hashed};
    float *d_table = p->work->grad + fs_radiance_at(p->net.shape, p->volume, RADIANCE_TABLE, NULL);
    for (int i = 0; i < p->groups; i++) {
        const VolumeSamples *v = &p->group[i].samples;
        const HashPlaces places = {{v->places.at[0], v->places.at[1], v->places.at[2]}, v->n};
        p->net.kernels->hashgrid->scatter(&hash, &places, v->code + (size_t)(RADIANCE_FEATURES * l) * v->stride,
                                          v->stride, d_table + RADIANCE_FEATURES * level->first,
                                          p->work->touched[p->volume] + level->first);
    }
}

static void sum_networks(const VolumePass *p)
{
    float *sum = p->work->grad + fs_radiance_at(p->net.shape, p->volume, RADIANCE_DENSITY, NULL);
    for (int i = 0; i < p->groups; i++)
        for (size_t k = 0; k < p->networks; k++) sum[k] += p->d_networks[(size_t)i * p->networks + k];
}

static void backward(const RasterPass *raster)
{
    for (int v = 0; v < VOLUMES; v++) {
        VolumePass *p = raster->volumes->pass[v];
        p->n_back = 0;
        for (int t = 0; t < raster->n; t++)
            if (raster->task[t]->volume == (Volume)v) p->back[p->n_back++] = raster->task[t];
        if (!p->n_back) continue;
        fs_threads_for(raster->threads, p->groups, backward_job, p);
        fs_threads_for(raster->threads, p->net.shape->levels, level_job, p);
        sum_networks(p);
    }
}

const Rasteriser fs_raster_volumes = {forward, backward};

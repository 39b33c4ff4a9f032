#include "engine/update.h"

#include <math.h>
#include <stddef.h>

#include "engine/view_loss.h"

enum { CHUNK = 2048 }; // Gaussians per job

// Within which parameters stay.
#define GAIN_MIN -3.0f // log: a twentieth of the usual gain
#define GAIN_MAX 5.0f  // in deep shade the flash gives a hundred times the light that was there
#define COLOR_MAX 4.0f // tone-mapped

// ---- over all clouds at once ----

typedef struct Jobs {
    const Update *update;
    int first[LAYERS + 1];      // first job of each layer
    double (*sums)[LOSS_TERMS]; // per job
    bool lit;                   // the transmitted cloud is stepped as (T_F, gain)
    ShadeLight light;           // of a flash amid the cameras
    AdamRate rate[CLOUD_FIELDS];
} Jobs;

typedef struct Range {
    int layer, begin, end;
    Cloud *cloud;
    CloudState *state;
    RasterTask *task;
} Range;

static Range range_of(const Jobs *jobs, int job)
{
    HostEngine *e = jobs->update->engine;
    int l = 0;
    while (job >= jobs->first[l + 1]) l++;
    int begin = (job - jobs->first[l]) * CHUNK, n = e->scene.cloud[l].n;
    return (Range){
        l, begin, begin + CHUNK < n ? begin + CHUNK : n, &e->scene.cloud[l], &e->state.cloud[l], jobs->update->task[l]};
}

// ---- loss terms on parameters ----

static void loss_job(void *context, int job, int worker)
{
    (void)worker;
    const Jobs *jobs = context;
    const HostEngine *e = jobs->update->engine;
    Range r = range_of(jobs, job);
    CloudLoss loss = {.kernels = &e->kernels,
                      .weight = jobs->update->args->weight,
                      .scene = &e->scene,
                      .cloud = r.cloud,
                      .graph = e->graph.start ? &e->graph : NULL,
                      .d_field = r.task->d_field,
                      .begin = r.begin,
                      .end = r.end};
    for (int k = 0; k < LOSS_TERMS; k++) {
        jobs->sums[job][k] = 0;
        if (loss.weight[k] > 0 && fs_loss_terms[k].gaussians && fs_loss_terms[k].layers >> r.layer & 1)
            fs_loss_terms[k].gaussians(&loss, jobs->sums[job]);
    }
}

// ---- Adam ----

static void clamp_field(float *x, size_t n, float low, float high)
{
    for (size_t i = 0; i < n; i++) x[i] = x[i] < low ? low : x[i] > high ? high : x[i];
}

static void keep_statistics(const Range *r)
{
    for (int i = r->begin; i < r->end; i++)
        if (r->task->seen[i]) {
            r->state->screen[2 * i] += r->task->d_screen[i];
            r->state->screen[2 * i + 1]++;
        }
}

static void adam_job(void *context, int job, int worker)
{
    (void)worker;
    const Jobs *jobs = context;
    const Kernels *k = &jobs->update->engine->kernels;
    const StepArgs *args = jobs->update->args;
    Range r = range_of(jobs, job);
    Cloud *cloud = r.cloud;
    const unsigned char *seen = r.task->seen;
    size_t n = (size_t)(r.end - r.begin);
    bool enter = jobs->lit && r.layer == LAYER_T_N;
    ShadeCloud shade = {cloud->field[CLOUD_MEANS], cloud->field[CLOUD_COLORS], cloud->field[CLOUD_GAINS]};
    ShadeGradients d_shade = {r.task->d_field[CLOUD_COLORS], r.task->d_field[CLOUD_GAINS]};
    if (enter) k->shade->enter(&jobs->light, &shade, seen, r.begin, r.end, &d_shade);
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f], at = w * (size_t)r.begin;
        if (!w || !(args->rate[f] > 0)) continue;
        AdamFields fields = {cloud->field[f] + at, r.task->d_field[f] + at, r.state->m.field[f] + at,
                             r.state->v.field[f] + at};
        k->adam->step_sparse(&fields, n, (int)w, seen + r.begin, jobs->rate[f]);
    }
    if (cloud->width[CLOUD_GAINS]) clamp_field(cloud->field[CLOUD_GAINS] + r.begin, n, GAIN_MIN, GAIN_MAX);
    if (cloud->width[CLOUD_COVERS]) clamp_field(cloud->field[CLOUD_COVERS] + r.begin, n, 0, 1);
    if (enter) k->shade->leave(&jobs->light, &shade, seen, r.begin, r.end);
    double darkest = args->darkest[r.layer];
    if (r.layer == LAYER_BETA)
        clamp_field(shade.colors + r.begin, n, (float)log(darkest / (1 - darkest)), INFINITY);
    else
        clamp_field(shade.colors + 3 * r.begin, 3 * n, (float)darkest, COLOR_MAX);
    if (args->statistics) keep_statistics(&r);
}

// ---- the update ----

static ShadeLight middle_light(const HostEngine *e)
{
    ShadeLight light = {.flash_distance = (float)e->scene.flash_distance};
    double middle[3];
    fs_update_photo_middle(e, middle);
    for (int k = 0; k < 3; k++) {
        light.centre[k] = (float)middle[k];
        light.tint[k] = (float)e->scene.gain_color[k];
    }
    return light;
}

int fs_update_run(const Update *update, StepResult *result, FsError *err)
{
    HostEngine *e = update->engine;
    Jobs jobs = {.update = update};
    int n = 0;
    for (int l = 0; l < LAYERS; l++) {
        jobs.first[l] = n;
        if (update->task[l]) n += (e->scene.cloud[l].n + CHUNK - 1) / CHUNK;
    }
    jobs.first[LAYERS] = n;
    jobs.sums = fs_arena_alloc(&e->arena, sizeof *jobs.sums * (size_t)n);
    if (!jobs.sums) return fs_error_memory(err);
    fs_threads_for(e->threads, n, loss_job, &jobs);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < LOSS_TERMS; k++) result->loss[k] += jobs.sums[i][k];
    fs_update_numbers_run(update, result);
    jobs.lit = fs_scene_lit(&e->scene) && e->scene.separation == SEPARATION_FULL;
    if (jobs.lit) jobs.light = middle_light(e);
    for (int f = 0; f < CLOUD_FIELDS; f++) jobs.rate[f] = fs_adam_rate(update->args->rate[f], update->args->step + 1);
    fs_threads_for(e->threads, n, adam_job, &jobs);
    return fs_radiance_is(&e->scene.field) ? fs_update_volumes_run(update, err) : 0;
}

// Generated clouds: a box of Gaussians in front of a camera, through the rasteriser and through a whole training step.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "bench/case.h"
#include "engine/raster_pass.h"
#include "engine/scratch.h"
#include "engine/made_scene.h"

enum { STRIP = 32, CHUNK = 2048 };

// Floating-point operations per contributing (pixel, splat) pair with three features, counted in the definition
// (raster.c; 2^t by a polynomial), so that a twin that gets along with fewer does not look slower:
// forward: offsets 2, exponent 8, 2^t 9, alpha T and T' 3, features 6;
// backward: offsets, exponent and 2^t 19, alpha T 1, features 12, rest 2, d t 5, T' 1, moments 11.
#define FORWARD_FLOPS 28
#define BACKWARD_FLOPS 51

typedef struct SplatsState {
    const BenchMachine *machine;
    Cloud cloud, m, v;
    Camera camera;
    RasterTask task;
    Arena arena;
    Planes photo, mu, var;
    void **scratch; // one per thread
    double pairs;
    int step;
} SplatsState;

static RasterPass pass_of(SplatsState *s)
{
    return (RasterPass){&s->machine->kernels, s->machine->threads, {&s->task}, 1, &s->camera, 0.1f};
}

static void forward(SplatsState *s)
{
    RasterPass pass = pass_of(s);
    if (fs_raster_tiles.forward(&pass, NULL) < 0) abort(); // out of memory amid a measurement
}

// The size of Gaussians at which about `wanted` pairs contribute: they grow with its square, nearly.
static void seek_pairs(SplatsState *s, double scale, double wanted)
{
    s->task.count = true;
    for (int i = 0;; i++) {
        fs_made_scene_fill(&s->cloud, scale);
        forward(s);
        s->pairs = (double)s->task.pairs;
        double ratio = wanted / fmax(s->pairs, 1);
        if (fabs(ratio - 1) < 1e-3 || i == 6) break;
        scale *= fmin(fmax(sqrt(ratio), 0.2), 5);
    }
    s->task.count = false; // not timed
}

static void make_photo(SplatsState *s)
{
    Planes *const planes[] = {&s->photo, &s->mu, &s->var};
    for (int i = 0; i < 3; i++) *planes[i] = fs_scratch_planes(&s->arena, &s->camera, 3);
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < s->photo.height; y++)
            for (int x = 0; x < s->photo.stride; x++)
                fs_planes_row(&s->photo, c, y)[x] =
                    0.5f + 0.4f * sinf(0.05f * (float)(x + 3 * c)) * cosf(0.07f * (float)y);
    int threads = fs_threads_count(s->machine->threads);
    s->scratch = ARENA_NEW(&s->arena, void *, threads);
    for (int i = 0; i < threads; i++)
        s->scratch[i] = fs_arena_alloc(&s->arena, fs_photometric_scratch(s->camera.width));
    PhotometricArgs args = {.I = &s->photo, .Y = &s->photo, .mu_Y = &s->mu, .var_Y = &s->var, .scratch = s->scratch[0]};
    s->machine->kernels.photometric->target_stats(&args, 0, s->photo.height);
}

void *fs_case_splats_open(const BenchMachine *machine, const BenchCase *what)
{
    SplatsState *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    s->machine = machine;
    double scale = 0.5 / sqrt(what->n);
    s->camera = fs_made_scene_camera(what->width, what->height);
    if (fs_cloud_new(&s->cloud, what->n, 3, 0, NULL) < 0 || fs_cloud_new(&s->m, what->n, 3, 0, NULL) < 0 ||
        fs_cloud_new(&s->v, what->n, 3, 0, NULL) < 0) {
        fs_case_splats_close(s);
        return NULL;
    }
    s->task = (RasterTask){.cloud = &s->cloud, .colors = 3, .train = true};
    seek_pairs(s, scale, what->wanted);
    make_photo(s);
    fs_case_splats_step(s); // a gradient for the backward case, and warm memory
    return s;
}

void fs_case_splats_close(void *state)
{
    SplatsState *s = state;
    fs_raster_pass_free_task(&s->task);
    fs_cloud_free(&s->cloud);
    fs_cloud_free(&s->m);
    fs_cloud_free(&s->v);
    fs_arena_free(&s->arena);
    free(s);
}

static BenchWork work_of(const SplatsState *s, double flops)
{
    return (BenchWork){.pairs = s->pairs, .flops = flops * s->pairs, .splats = s->cloud.n};
}

BenchWork fs_case_splats_forward(void *state)
{
    forward(state);
    return work_of(state, FORWARD_FLOPS);
}

BenchWork fs_case_splats_backward(void *state)
{
    SplatsState *s = state;
    RasterPass pass = pass_of(s);
    fs_raster_tiles.backward(&pass);
    return work_of(s, BACKWARD_FLOPS);
}

static void loss_job(void *context, int strip, int worker)
{
    SplatsState *s = context;
    int y0 = strip * STRIP, y1 = y0 + STRIP < s->photo.height ? y0 + STRIP : s->photo.height;
    PhotometricArgs args = {.I = &s->task.feature,
                            .Y = &s->photo,
                            .mu_Y = &s->mu,
                            .var_Y = &s->var,
                            .kappa = 0.1f,
                            .weight = 1,
                            .d_I = &s->task.d_feature,
                            .scratch = s->scratch[worker]};
    s->machine->kernels.photometric->loss(&args, y0, y1);
}

BenchWork fs_case_splats_raster(void *state)
{
    SplatsState *s = state;
    forward(s);
    for (int c = 0; c < 3; c++) // forward gave new, unset planes for the gradient: any will do
        memcpy(fs_planes_row(&s->task.d_feature, c, 0), fs_planes_row(&s->photo, c, 0),
               sizeof(float) * (size_t)s->photo.stride * (size_t)s->photo.height);
    fs_case_splats_backward(s);
    return work_of(s, FORWARD_FLOPS + BACKWARD_FLOPS);
}

static void adam_job(void *context, int job, int worker)
{
    (void)worker;
    SplatsState *s = context;
    // The rates are tiny, so that the hundredth call sees the same cloud as the first.
    size_t begin = (size_t)job * CHUNK, end = begin + CHUNK, n = (size_t)s->cloud.n;
    if (end > n) end = n;
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)s->cloud.width[f], at = w * begin;
        if (!w) continue;
        AdamFields fields = {s->cloud.field[f] + at, s->task.d_field[f] + at, s->m.field[f] + at, s->v.field[f] + at};
        s->machine->kernels.adam->step_sparse(&fields, end - begin, (int)w, s->task.seen + begin,
                                              fs_adam_rate(1e-9, s->step));
    }
}

BenchWork fs_case_splats_step(void *state)
{
    SplatsState *s = state;
    forward(s);
    fs_threads_for(s->machine->threads, (s->photo.height + STRIP - 1) / STRIP, loss_job, s);
    fs_case_splats_backward(s);
    s->step++;
    fs_threads_for(s->machine->threads, (s->cloud.n + CHUNK - 1) / CHUNK, adam_job, s);
    return work_of(s, FORWARD_FLOPS + BACKWARD_FLOPS);
}

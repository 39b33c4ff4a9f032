// What a step does to radiance fields once it has their gradients: Adam, and every so many steps another look at which
// cells of the grids are empty.
#include <math.h>
#include <string.h>

#include "base/rng.h"
#include "base/threads.h"
#include "engine/update.h"

enum {
    ROWS = 8192,  // of a table, a job
    CELLS = 2048, // of a grid, a job
    GRID_EARLY = 256,
    GRID_EVERY_EARLY = 16,
    GRID_EVERY = 32, // steps
};
#define GRID_KEEPS 0.95f // of what a cell was, where it is thinner now
#define PACE 0.1f        // share of a step in the mean number of samples

typedef struct Jobs {
    HostEngine *engine;
    const StepArgs *args;
    Volume volume;
    AdamRate rate[RADIANCE_LEARNED];
    float **scratch; // by worker
} Jobs;

static AdamFields fields_of(const HostEngine *e, size_t at)
{
    return (AdamFields){e->scene.field.x + at, e->volumes.grad + at, e->state.field_m + at, e->state.field_v + at};
}

// Rows without gradients, and their moments, stay.
static void table_job(void *context, int job, int worker)
{
    (void)worker;
    const Jobs *j = context;
    HostEngine *e = j->engine;
    size_t n, at = fs_radiance_at(&e->scene.field.shape, j->volume, RADIANCE_TABLE, &n);
    size_t first = (size_t)job * ROWS, rows = n / RADIANCE_FEATURES - first;
    if (rows > ROWS) rows = ROWS;
    unsigned char *touched = e->volumes.touched[j->volume] + first;
    AdamFields fields = fields_of(e, at + first * RADIANCE_FEATURES);
    e->kernels.adam->step_sparse(&fields, rows, RADIANCE_FEATURES, touched, j->rate[RADIANCE_TABLE]);
    memset(e->volumes.grad + at + first * RADIANCE_FEATURES, 0, rows * RADIANCE_FEATURES * sizeof(float));
    memset(touched, 0, rows);
}

static void step_networks(const Jobs *j)
{
    HostEngine *e = j->engine;
    for (int p = RADIANCE_DENSITY; p < RADIANCE_LEARNED; p++) {
        size_t n, at = fs_radiance_at(&e->scene.field.shape, j->volume, (RadiancePart)p, &n);
        AdamFields fields = fields_of(e, at);
        e->kernels.adam->step(&fields, n, j->rate[p]);
        memset(e->volumes.grad + at, 0, n * sizeof(float));
    }
}

// ---- the grid ----

static void place_cells(const Jobs *j, int first, VolumeSamples *v)
{
    const int grid = j->engine->scene.field.shape.grid;
    Rng rng = fs_rng_new((j->args->seed * 1000003u + (uint64_t)j->args->step) << 24 ^ (uint64_t)first);
    for (int i = 0; i < v->n; i++) {
        int cell[3] = {(first + i) % grid, (first + i) / grid % grid, (first + i) / grid / grid};
        for (int k = 0; k < 3; k++)
            v->places.at[k][i] = fminf(((float)cell[k] + fs_rng_uniform(&rng)) / (float)grid, 1);
    }
}

static void grid_job(void *context, int job, int worker)
{
    const Jobs *j = context;
    Radiance *field = &j->engine->scene.field;
    size_t n, at = fs_radiance_at(&field->shape, j->volume, RADIANCE_GRID, &n);
    int first = job * CELLS, cells = (int)n - first < CELLS ? (int)n - first : CELLS;
    VolumeNet net = fs_volume_net(&j->engine->kernels, field, j->volume, 1);
    VolumeSamples v = fs_volume_net_samples(&field->shape, cells, j->scratch[worker]);
    place_cells(j, first, &v);
    fs_volume_net_density(&net, &v);
    float *grid = field->x + at + first;
    for (int i = 0; i < cells; i++) grid[i] = fmaxf(grid[i] < 0 ? 0 : GRID_KEEPS * grid[i], v.tau[i]);
}

static int look_at_grid(Jobs *j, FsError *err)
{
    HostEngine *e = j->engine;
    const RadianceShape *shape = &e->scene.field.shape;
    int workers = e->threads ? fs_threads_count(e->threads) : 1;
    size_t n, floats = fs_volume_net_floats(shape, fs_volume_net_stride(CELLS));
    fs_radiance_at(shape, j->volume, RADIANCE_GRID, &n);
    j->scratch = ARENA_NEW(&e->arena, float *, workers);
    for (int i = 0; i < workers && j->scratch; i++) j->scratch[i] = ARENA_NEW(&e->arena, float, floats);
    if (e->arena.failed) return fs_error_memory(err);
    fs_threads_for(e->threads, ((int)n + CELLS - 1) / CELLS, grid_job, j);
    fs_volume_march_occupied(&e->scene.field, j->volume, e->volumes.occupied[j->volume]);
    return 0;
}

// ---- all of it ----

static void keep_pace(HostEngine *e, Volume volume)
{
    float *pace = fs_radiance_part(&e->scene.field, volume, RADIANCE_PACE);
    float now = (float)e->volumes.samples[volume] / (float)e->volumes.rays;
    *pace = *pace > 0 ? (1 - PACE) * *pace + PACE * now : now;
}

int fs_update_volumes_run(const Update *update, FsError *err)
{
    HostEngine *e = update->engine;
    const RadianceShape *shape = &e->scene.field.shape;
    Jobs jobs = {.engine = e, .args = update->args};
    int done = update->args->step + 1, every = done <= GRID_EARLY ? GRID_EVERY_EARLY : GRID_EVERY;
    for (int p = 0; p < RADIANCE_LEARNED; p++)
        jobs.rate[p] = fs_adam_rate(update->args->field_rate * fs_radiance_parts[p].rate, done);
    for (int v = 0; v < VOLUMES; v++) {
        size_t n;
        if (!shape->colors[v]) continue;
        jobs.volume = (Volume)v;
        fs_radiance_at(shape, jobs.volume, RADIANCE_TABLE, &n);
        fs_threads_for(e->threads, (int)((n / RADIANCE_FEATURES + ROWS - 1) / ROWS), table_job, &jobs);
        step_networks(&jobs);
        if (done % every == 0) MUST(look_at_grid(&jobs, err));
        if (update->args->every <= 1) keep_pace(e, jobs.volume);
    }
    return 0;
}

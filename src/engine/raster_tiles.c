// The rasteriser by tiles: visible splats sorted by depth, listed by row of tiles, then by tile; tiles are jobs.
#include "engine/raster_pass.h"

#include <limits.h>
#include <string.h>

typedef struct BandEntry {
    uint32_t splat, mask, tile_x;
} BandEntry;

typedef struct TileLists {
    int n, height, tiles_x, tiles_y;
    const Splat *splats;
    uint32_t *order, *spare; // visible splats by depth
    uint32_t *key, *spare_key;
    int64_t *band_splat_start; // (tiles_y + 1) into band_splat
    uint32_t *band_splat;      // visible splats of each row of tiles, by depth
    int64_t *band_bound;       // (tiles_y + 1): start of the band's part of band_entry
    BandEntry *band_entry;
    int *band_entries; // (tiles_y): how many the band has
    int64_t *band_at;  // (tiles_y): where list_job is
    int *tile_start;   // (tiles + 1) into entry
    int *tile_count;   // (tiles)
    TileEntry *entry;
    int n_entries;
    int *slot_start; // (n + 1) into record
    float *record;   // (n_entries, FS_RECORD) of gradients
    long *tile_pairs;
} TileLists;

typedef struct Run { // what the jobs of all phases see
    const RasterPass *pass;
    int first[RASTER_TASKS_MAX]; // first job of each task in this phase
} Run;

// ---- jobs numbered over several tasks ----

static RasterTask *task_of(const Run *run, int job, int *own)
{
    int t = run->pass->n - 1;
    while (job < run->first[t]) t--;
    *own = job - run->first[t];
    return run->pass->task[t];
}

static void run_phase(const RasterPass *pass, ThreadsJob *job, int (*count)(const RasterTask *))
{
    Run run = {.pass = pass};
    int jobs = 0;
    for (int t = 0; t < pass->n; t++) {
        run.first[t] = jobs;
        jobs += count(pass->task[t]);
    }
    fs_threads_for(pass->threads, jobs, job, &run);
}

static int count_chunks(const RasterTask *task)
{
    return task->work->chunks;
}
static int count_one(const RasterTask *task)
{
    return task->cloud->n > 0;
}
static int count_bands(const RasterTask *task)
{
    return task->work->tiles->tiles_y;
}
static int count_tiles(const RasterTask *task)
{
    return task->work->tiles->tiles_x * task->work->tiles->tiles_y;
}

// ---- phase 1: project ----

static void project_job(void *context, int job, int worker)
{
    (void)worker;
    const Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    fs_raster_pass_project(task, run->pass->kernels, own);
}

// ---- phase 2: sort the visible by depth, list them by row of tiles ----

static void radix_pass(const uint32_t *key, const uint32_t *value, uint32_t *key_out, uint32_t *value_out, int n,
                       int shift)
{
    int start[2049] = {0};
    for (int i = 0; i < n; i++) start[(key[i] >> shift & 2047) + 1]++;
    for (int i = 0; i < 2048; i++) start[i + 1] += start[i];
    for (int i = 0; i < n; i++) {
        int to = start[key[i] >> shift & 2047]++;
        key_out[to] = key[i];
        value_out[to] = value[i];
    }
}

static void sort_job(void *context, int job, int worker)
{
    (void)worker;
    int own;
    RasterTask *task = task_of(context, job, &own);
    TileLists *w = task->work->tiles;
    int n = 0;
    for (int i = 0; i < w->n; i++) {
        const Splat *s = &w->splats[i];
        if (s->tile[0] == s->tile[2]) continue;
        memcpy(&w->key[n], &s->depth, sizeof(float)); // positive floats sort as integers
        w->order[n++] = (uint32_t)i;
        for (int y = s->tile[1]; y < s->tile[3]; y++) {
            w->band_splat_start[y + 1]++;
            w->band_bound[y + 1] += s->tile[2] - s->tile[0];
        }
    }
    radix_pass(w->key, w->order, w->spare_key, w->spare, n, 0);
    radix_pass(w->spare_key, w->spare, w->key, w->order, n, 11);
    radix_pass(w->key, w->order, w->spare_key, w->spare, n, 22);
    task->n_visible = n;
    for (int y = 0; y < w->tiles_y; y++) {
        w->band_splat_start[y + 1] += w->band_splat_start[y];
        w->band_bound[y + 1] += w->band_bound[y];
    }
}

static void list_job(void *context, int job, int worker)
{
    (void)worker;
    int own;
    RasterTask *task = task_of(context, job, &own);
    TileLists *w = task->work->tiles;
    int64_t *at = w->band_at;
    memcpy(at, w->band_splat_start, sizeof *at * (size_t)w->tiles_y);
    for (int i = 0; i < task->n_visible; i++) {
        uint32_t id = w->spare[i];
        if (i + 16 < task->n_visible) __builtin_prefetch(&w->splats[w->spare[i + 16]]);
        for (int y = w->splats[id].tile[1]; y < w->splats[id].tile[3]; y++) w->band_splat[at[y]++] = id;
    }
}

// ---- phase 3: which rows of which tiles each splat touches ----

static void band_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int y;
    TileLists *w = task_of(run, job, &y)->work->tiles;
    BandEntry *out = w->band_entry + w->band_bound[y];
    int *count = w->tile_count + y * w->tiles_x, rows = w->height - y * FS_TILE_H;
    const uint32_t inside = rows < FS_TILE_H ? (1u << rows) - 1 : 0xffffffffu;
    for (int64_t i = w->band_splat_start[y]; i < w->band_splat_start[y + 1]; i++) {
        uint32_t id = w->band_splat[i];
        const Splat *s = &w->splats[id];
        if (i + 8 < w->band_splat_start[y + 1]) __builtin_prefetch(&w->splats[w->band_splat[i + 8]]);
        uint32_t mask[64];
        for (int x0 = s->tile[0]; x0 < s->tile[2]; x0 += 64) {
            int tiles = s->tile[2] - x0 < 64 ? s->tile[2] - x0 : 64;
            run->pass->kernels->raster->cover(s, x0 * FS_TILE_W, y * FS_TILE_H, tiles, FS_T_MIN, mask);
            for (int k = 0; k < tiles; k++) {
                if (!(mask[k] & inside)) continue;
                *out++ = (BandEntry){id, mask[k] & inside, (uint32_t)(x0 + k)};
                count[x0 + k]++;
            }
        }
    }
    w->band_entries[y] = (int)(out - (w->band_entry + w->band_bound[y]));
}

static void scatter_job(void *context, int job, int worker)
{
    (void)worker;
    int y;
    TileLists *w = task_of(context, job, &y)->work->tiles;
    int *at = w->tile_count + y * w->tiles_x;
    memcpy(at, w->tile_start + y * w->tiles_x, sizeof(int) * (size_t)w->tiles_x);
    const BandEntry *in = w->band_entry + w->band_bound[y];
    for (int i = 0, n = w->band_entries[y]; i < n; i++)
        w->entry[at[in[i].tile_x]++] = (TileEntry){in[i].splat, in[i].mask, 0};
}

// Numbers the gradient records by splat: what backward writes all over, the sums then read in order.
static void number_records(TileLists *w)
{
    int *start = w->slot_start;
    memset(start, 0, sizeof(int) * (size_t)(w->n + 1));
    for (int i = 0; i < w->n_entries; i++) start[w->entry[i].splat + 1]++;
    for (int i = 0; i < w->n; i++) start[i + 1] += start[i];
    for (int i = 0; i < w->n_entries; i++) w->entry[i].slot = (uint32_t)start[w->entry[i].splat]++;
    memmove(start + 1, start, sizeof(int) * (size_t)w->n); // back to starts
    start[0] = 0;
}

// ---- phase 4: forward ----

static RasterTile tile_of(const RasterTask *task, int tile)
{
    const TileLists *w = task->work->tiles;
    return (RasterTile){.x0 = tile % w->tiles_x * FS_TILE_W,
                        .y0 = tile / w->tiles_x * FS_TILE_H,
                        .n = w->tile_start[tile + 1] - w->tile_start[tile],
                        .entry = w->entry + w->tile_start[tile],
                        .splats = w->splats,
                        .features = task->colors + task->depth,
                        .t_min = FS_T_MIN,
                        .transmittance_min = FS_TRANSMITTANCE_MIN,
                        .count = task->count};
}

static int count_forward(const RasterTask *task)
{
    return 1 + count_tiles(task);
}

// The first job of a task is not a tile: it does for backward what cannot be shared, while the others go on.
static void forward_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    if (own == 0) {
        if (task->train) number_records(task->work->tiles);
        return;
    }
    own--;
    RasterTile tile = tile_of(task, own);
    fs_raster_pass_tile_forward(run->pass->kernels, task, &tile, &task->work->tiles->tile_pairs[own]);
}

// ---- phase 5: backward ----

static void backward_job(void *context, int job, int worker)
{
    (void)worker;
    const Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    RasterTile tile = tile_of(task, own);
    if (tile.n) fs_raster_pass_tile_backward(run->pass->kernels, task, &tile, task->work->tiles->record);
}

static void reduce_job(void *context, int job, int worker)
{
    (void)worker;
    const Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    const RasterWork *w = task->work;
    const TileLists *lists = w->tiles;
    for (int i = own * RASTER_CHUNK, end = fs_raster_pass_chunk_end(w, own); i < end; i++) {
        float sum[FS_RECORD] = {0};
        for (int p = lists->slot_start[i]; p < lists->slot_start[i + 1]; p++) {
            const float *record = lists->record + (size_t)p * FS_RECORD;
            for (int k = 0; k < FS_RECORD; k++) sum[k] += record[k];
        }
        memcpy(w->moment + (size_t)i * FS_RECORD, sum, sizeof sum);
    }
    fs_raster_pass_gradients(task, run->pass->kernels, own);
}

// ---- memory, which grows between the phases ----

static void set_up(RasterTask *task, const Camera *camera, float near)
{
    fs_raster_pass_set_up(task, camera, near);
    Arena *a = &task->arena;
    TileLists *w = ARENA_NEW(a, TileLists, 1);
    if (!w) return;
    int n = task->cloud->n, tx = (camera->width + FS_TILE_W - 1) / FS_TILE_W;
    int ty = (camera->height + FS_TILE_H - 1) / FS_TILE_H;
    *w = (TileLists){.n = n, .height = camera->height, .tiles_x = tx, .tiles_y = ty, .splats = task->work->splats};
    task->work->tiles = w;
    w->order = ARENA_NEW(a, uint32_t, n);
    w->spare = ARENA_NEW(a, uint32_t, n);
    w->key = ARENA_NEW(a, uint32_t, n);
    w->spare_key = ARENA_NEW(a, uint32_t, n);
    w->band_splat_start = ARENA_NEW(a, int64_t, ty + 1);
    w->band_bound = ARENA_NEW(a, int64_t, ty + 1);
    w->band_entries = ARENA_NEW(a, int, ty);
    w->band_at = ARENA_NEW(a, int64_t, ty);
    w->tile_start = ARENA_NEW(a, int, tx *ty + 1);
    w->tile_count = ARENA_NEW(a, int, tx *ty);
    w->tile_pairs = ARENA_NEW(a, long, tx *ty);
    if (task->train) w->slot_start = ARENA_NEW(a, int, n + 1);
    if (a->failed) return;
    memset(w->band_splat_start, 0, sizeof(int64_t) * (size_t)(ty + 1));
    memset(w->band_bound, 0, sizeof(int64_t) * (size_t)(ty + 1));
    memset(w->tile_count, 0, sizeof(int) * (size_t)(tx * ty));
}

static int check_memory(const RasterPass *pass, FsError *err)
{
    for (int t = 0; t < pass->n; t++)
        if (pass->task[t]->arena.failed) return fs_error_memory(err);
    return 0;
}

// Room for the lists of the rows of tiles.
static int place_bands(const RasterPass *pass, FsError *err)
{
    for (int t = 0; t < pass->n; t++) {
        TileLists *w = pass->task[t]->work->tiles;
        if (w->band_bound[w->tiles_y] > INT_MAX)
            return fs_error_set(err, FS_ERR_NUMERIC,
                                "%lld places of splats in tiles, at most %d can be numbered; use a smaller --long-edge "
                                "or --max-splats",
                                (long long)w->band_bound[w->tiles_y], INT_MAX);
        w->band_splat = ARENA_NEW(&pass->task[t]->arena, uint32_t, w->band_splat_start[w->tiles_y]);
        w->band_entry = ARENA_NEW(&pass->task[t]->arena, BandEntry, w->band_bound[w->tiles_y]);
    }
    return check_memory(pass, err);
}

// Tile starts from tile counts; makes room for the entries.
static void place_tiles(RasterTask *task)
{
    TileLists *w = task->work->tiles;
    w->tile_start[0] = 0;
    for (int t = 0; t < w->tiles_x * w->tiles_y; t++) w->tile_start[t + 1] = w->tile_start[t] + w->tile_count[t];
    w->n_entries = w->tile_start[w->tiles_x * w->tiles_y];
    w->entry = ARENA_NEW(&task->arena, TileEntry, w->n_entries);
    if (!task->train) return;
    w->record = ARENA_NEW(&task->arena, float, (size_t)w->n_entries *FS_RECORD);
}

static int forward(const RasterPass *pass, FsError *err)
{
    int rc;
    for (int t = 0; t < pass->n; t++) set_up(pass->task[t], pass->camera, pass->near);
    TRY(check_memory(pass, err));
    run_phase(pass, project_job, count_chunks);
    run_phase(pass, sort_job, count_one);
    TRY(place_bands(pass, err));
    run_phase(pass, list_job, count_one);
    run_phase(pass, band_job, count_bands);
    for (int t = 0; t < pass->n; t++) place_tiles(pass->task[t]);
    TRY(check_memory(pass, err));
    run_phase(pass, scatter_job, count_bands);
    run_phase(pass, forward_job, count_forward);
    for (int t = 0; t < pass->n; t++) {
        RasterTask *task = pass->task[t];
        task->pairs = 0;
        for (int i = 0; i < count_tiles(task); i++) task->pairs += task->work->tiles->tile_pairs[i];
    }
fail:
    return rc;
}

static void backward(const RasterPass *pass)
{
    run_phase(pass, backward_job, count_tiles);
    run_phase(pass, reduce_job, count_chunks);
    for (int t = 0; t < pass->n; t++) fs_raster_pass_sum_tint(pass->task[t]);
}

const Rasteriser fs_raster_tiles = {forward, backward};

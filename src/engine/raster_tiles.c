// The rasteriser by tiles: for each splat the tiles that it touches, then, splats in order of depth, for each tile its
// splats; tiles are jobs.
#include "engine/raster_pass.h"

#include <limits.h>
#include <string.h>

typedef struct TileHit { // a splat in a tile; its number is that of the gradient record
    uint32_t tile, mask;
} TileHit;

typedef struct Chunk { // RASTER_CHUNK splats
    int n_visible;
    uint32_t nearest, farthest; // keys
    int64_t bound;              // hits that its boxes could make
    int64_t first;              // its part of `hit`
} Chunk;

typedef struct TileLists {
    int height, tiles_x, tiles_y, n_chunks;
    const Splat *splats;
    Chunk *chunk;
    uint32_t *key, *id; // visible splats, each chunk's from the chunk's first place on; then all, by depth
    uint32_t *spare_key, *spare_id;
    int n_visible;
    TileHit *hit;
    int (*hits)[2];  // (n): a splat's first, and one past its last
    int *count;      // (threads, tiles): hits that a thread found
    int *tile_start; // (tiles + 1) into entry
    int *tile_at[2]; // (tiles): where the next one from the front goes, and, plus one, from the back
    TileEntry *entry;
    float *record; // (hits, FS_RECORD) of gradients
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
static int count_ends(const RasterTask *task)
{
    (void)task;
    return 2;
}
static int count_tiles(const RasterTask *task)
{
    return task->work->tiles->tiles_x * task->work->tiles->tiles_y;
}

// ---- phase 1: project, find the visible ----

static void project_job(void *context, int job, int worker)
{
    (void)worker;
    const Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    fs_raster_pass_project(task, run->pass->kernels, own);
    TileLists *w = task->work->tiles;
    Chunk *c = &w->chunk[own];
    *c = (Chunk){.nearest = UINT32_MAX};
    for (int i = own * RASTER_CHUNK, at = i, end = fs_raster_pass_chunk_end(task->work, own); i < end; i++) {
        const Splat *s = &w->splats[i];
        uint32_t key;
        memcpy(&key, &s->depth, sizeof key); // positive floats sort as integers
        w->key[at] = key;
        w->id[at] = (uint32_t)i;
        if (s->tile[0] == s->tile[2]) continue;
        at++;
        c->n_visible++;
        c->bound += (int64_t)(s->tile[2] - s->tile[0]) * (s->tile[3] - s->tile[1]);
        c->nearest = key < c->nearest ? key : c->nearest;
        c->farthest = key > c->farthest ? key : c->farthest;
    }
}

// ---- phase 2: sort by depth; meanwhile, which rows of which tiles each splat touches ----

enum { DIGIT = 11, DIGITS = 1 << DIGIT };

// Moves n pairs to the places in the order of a digit.
static void radix_pass(const uint32_t *from[2], uint32_t *to[2], int n, const int count[DIGITS], int shift)
{
    int start[DIGITS], sum = 0;
    for (int d = 0; d < DIGITS; sum += count[d++]) start[d] = sum;
    for (int i = 0; i < n; i++) {
        int at = start[from[0][i] >> shift & (DIGITS - 1)]++;
        to[0][at] = from[0][i];
        to[1][at] = from[1][i];
    }
}

// By depth, in two digits of what remains of its range: depths that differ by a 2^-19th or so count as equal.
static void sort(TileLists *w)
{
    uint32_t nearest = UINT32_MAX, farthest = 0;
    int count[2][DIGITS] = {0}, n = 0, drop = 0;
    for (int c = 0; c < w->n_chunks; c++) {
        nearest = w->chunk[c].nearest < nearest ? w->chunk[c].nearest : nearest;
        farthest = w->chunk[c].farthest > farthest ? w->chunk[c].farthest : farthest;
    }
    while (farthest > nearest && (farthest - nearest) >> drop >> (2 * DIGIT)) drop++;
    for (int c = 0; c < w->n_chunks; c++)
        for (int i = c * RASTER_CHUNK, end = i + w->chunk[c].n_visible; i < end; i++, n++) {
            uint32_t key = (w->key[i] - nearest) >> drop;
            count[0][key & (DIGITS - 1)]++;
            count[1][key >> DIGIT]++;
            w->key[n] = key;
            w->id[n] = w->id[i];
        }
    uint32_t *pairs[2] = {w->key, w->id}, *spare[2] = {w->spare_key, w->spare_id};
    radix_pass((const uint32_t *[2]){w->key, w->id}, spare, n, count[0], 0);
    radix_pass((const uint32_t *[2]){w->spare_key, w->spare_id}, pairs, n, count[1], DIGIT);
}

static void cover_chunk(const RasterTask *task, const RasterKernels *kernels, int chunk, int worker)
{
    TileLists *w = task->work->tiles;
    const int left = w->height - (w->tiles_y - 1) * FS_TILE_H; // rows in the last row of tiles
    int *count = w->count + (size_t)worker * (size_t)(w->tiles_x * w->tiles_y);
    TileHit *out = w->hit + w->chunk[chunk].first;
    for (int i = chunk * RASTER_CHUNK, end = fs_raster_pass_chunk_end(task->work, chunk); i < end; i++) {
        const Splat *s = &w->splats[i];
        w->hits[i][0] = (int)(out - w->hit);
        for (int y = s->tile[1]; y < s->tile[3]; y++) {
            const uint32_t inside = y + 1 == w->tiles_y ? 0xffffffffu >> (FS_TILE_H - left) : 0xffffffffu;
            uint32_t mask[64];
            for (int x0 = s->tile[0]; x0 < s->tile[2]; x0 += 64) {
                int tiles = s->tile[2] - x0 < 64 ? s->tile[2] - x0 : 64;
                kernels->cover(s, x0 * FS_TILE_W, y * FS_TILE_H, tiles, FS_T_MIN, mask);
                for (int k = 0; k < tiles; k++) {
                    const int tile = y * w->tiles_x + x0 + k, any = (mask[k] & inside) != 0;
                    *out = (TileHit){(uint32_t)tile, mask[k] & inside};
                    out += any;
                    count[tile] += any;
                }
            }
        }
        w->hits[i][1] = (int)(out - w->hit);
    }
}

static int count_sort_and_chunks(const RasterTask *task)
{
    return 1 + count_chunks(task);
}

static void cover_job(void *context, int job, int worker)
{
    const Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    if (own == 0)
        sort(task->work->tiles);
    else
        cover_chunk(task, run->pass->kernels->raster, own - 1, worker);
}

// ---- phase 3: the tiles' lists, the near half of the splats from the front on, the others from the back ----

static void scatter(TileLists *w, int i, int end, int step)
{
    int *at = w->tile_at[step < 0];
    for (; i != end; i += step) {
        uint32_t id = w->id[i];
        if ((unsigned)(i + 16 * step) < (unsigned)w->n_visible) { // they lie far apart
            __builtin_prefetch(w->hits[w->id[i + 16 * step]]);
            __builtin_prefetch(w->hit + w->hits[w->id[i + 8 * step]][0]);
        }
        for (int h = w->hits[id][0]; h < w->hits[id][1]; h++) {
            uint32_t tile = w->hit[h].tile;
            w->entry[step < 0 ? --at[tile] : at[tile]++] = (TileEntry){id, w->hit[h].mask, (uint32_t)h};
        }
    }
}

static void scatter_job(void *context, int job, int worker)
{
    (void)worker;
    int own;
    TileLists *w = task_of(context, job, &own)->work->tiles;
    if (own == 0)
        scatter(w, 0, w->n_visible / 2, 1);
    else
        scatter(w, w->n_visible - 1, w->n_visible / 2 - 1, -1);
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
                        .features = fs_raster_pass_features(task),
                        .t_min = FS_T_MIN,
                        .transmittance_min = FS_TRANSMITTANCE_MIN,
                        .count = task->count,
                        .median = task->median};
}

static void forward_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
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
        for (int p = lists->hits[i][0]; p < lists->hits[i][1]; p++) {
            const float *record = lists->record + (size_t)p * FS_RECORD;
            for (int k = 0; k < FS_RECORD; k++) sum[k] += record[k];
        }
        memcpy(w->moment + (size_t)i * FS_RECORD, sum, sizeof sum);
    }
    fs_raster_pass_gradients(task, run->pass->kernels, own);
}

// ---- memory, which grows between the phases ----

static void set_up(const RasterPass *pass, RasterTask *task, int n_threads)
{
    const Camera *camera = pass->camera;
    fs_raster_pass_set_up(task, pass);
    Arena *a = &task->arena;
    TileLists *w = ARENA_NEW(a, TileLists, 1);
    if (!w) return;
    int n = task->cloud->n, tx = (camera->width + FS_TILE_W - 1) / FS_TILE_W;
    int ty = (camera->height + FS_TILE_H - 1) / FS_TILE_H;
    size_t tiles = (size_t)tx * (size_t)ty, counts = (size_t)n_threads * tiles;
    *w = (TileLists){.height = camera->height,
                     .tiles_x = tx,
                     .tiles_y = ty,
                     .n_chunks = task->work->chunks,
                     .splats = task->work->splats};
    task->work->tiles = w;
    w->chunk = ARENA_NEW(a, Chunk, w->n_chunks);
    w->key = ARENA_NEW(a, uint32_t, n);
    w->id = ARENA_NEW(a, uint32_t, n);
    w->spare_key = ARENA_NEW(a, uint32_t, n);
    w->spare_id = ARENA_NEW(a, uint32_t, n);
    w->hits = (int(*)[2])fs_arena_alloc(a, sizeof(int[2]) * (size_t)n);
    w->tile_start = ARENA_NEW(a, int, tiles + 1);
    w->tile_pairs = ARENA_NEW(a, long, tiles);
    w->count = ARENA_NEW(a, int, counts);
    for (int k = 0; k < 2; k++) w->tile_at[k] = ARENA_NEW(a, int, tiles);
    if (a->failed) return;
    memset(w->count, 0, sizeof(int) * counts);
}

static int check_memory(const RasterPass *pass, FsError *err)
{
    for (int t = 0; t < pass->n; t++)
        if (pass->task[t]->arena.failed) return fs_error_memory(err);
    return 0;
}

// Room for the hits, as many as the boxes could make.
static int place_hits(RasterTask *task, FsError *err)
{
    TileLists *w = task->work->tiles;
    int64_t bound = 0;
    for (int c = 0; c < w->n_chunks; c++) {
        w->chunk[c].first = bound;
        bound += w->chunk[c].bound;
        w->n_visible += w->chunk[c].n_visible;
    }
    task->n_visible = w->n_visible;
    if (bound > INT_MAX)
        return fs_error_set(err, FS_ERR_NUMERIC,
                            "%lld places of splats in tiles, at most %d can be numbered; use a smaller --long-edge "
                            "or --max-splats",
                            (long long)bound, INT_MAX);
    w->hit = ARENA_NEW(&task->arena, TileHit, bound + 1);
    if (task->train) w->record = ARENA_NEW(&task->arena, float, (size_t)bound *FS_RECORD);
    return 0;
}

// Where the tiles' lists begin; makes room for the entries.
static void place_tiles(RasterTask *task, int n_threads)
{
    TileLists *w = task->work->tiles;
    const int n_tiles = count_tiles(task);
    int at = 0;
    for (int t = 0; t < n_tiles; t++) {
        w->tile_start[t] = w->tile_at[0][t] = at;
        for (int k = 0; k < n_threads; k++) at += w->count[(size_t)k * (size_t)n_tiles + (size_t)t];
        w->tile_at[1][t] = at;
    }
    w->tile_start[n_tiles] = at;
    w->entry = ARENA_NEW(&task->arena, TileEntry, at);
}

static int forward(const RasterPass *pass, FsError *err)
{
    int rc, n_threads = fs_threads_count(pass->threads);
    for (int t = 0; t < pass->n; t++) set_up(pass, pass->task[t], n_threads);
    TRY(check_memory(pass, err));
    run_phase(pass, project_job, count_chunks);
    for (int t = 0; t < pass->n; t++) TRY(place_hits(pass->task[t], err));
    TRY(check_memory(pass, err));
    run_phase(pass, cover_job, count_sort_and_chunks);
    for (int t = 0; t < pass->n; t++) place_tiles(pass->task[t], n_threads);
    TRY(check_memory(pass, err));
    run_phase(pass, scatter_job, count_ends);
    run_phase(pass, forward_job, count_tiles);
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

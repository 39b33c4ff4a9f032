#include "engine/raster_task.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CHUNK 1024 // Gaussians per job

typedef struct BandEntry {
    uint32_t splat, mask, tile_x;
} BandEntry;

typedef struct RasterWork {
    ProjectCamera camera;
    float near;
    int n, tiles_x, tiles_y, chunks;
    Splat *splats;           // (n)
    float *shaded;           // (n, 3) with light
    uint32_t *order, *spare; // visible splats by depth
    uint32_t *key, *spare_key;
    int *band_splat_start; // (tiles_y + 1) into band_splat
    uint32_t *band_splat;  // visible splats of each row of tiles, by depth
    int *band_bound;       // (tiles_y + 1): start of the band's part of band_entry
    BandEntry *band_entry;
    int *band_entries; // (tiles_y): how many the band has
    int *tile_start;   // (tiles + 1) into entry
    int *tile_count;   // (tiles)
    TileEntry *entry;
    int n_entries;
    int *slot_start; // (n + 1) into record
    float *record;   // (n_entries, FS_RECORD) of gradients
    float *moment;   // (n, FS_RECORD)
    float *d_shaded, *d_depth;
    long *tile_pairs;
    double (*chunk_tint)[3];
} RasterWork;

typedef struct Run { // what the jobs of all phases see
    const Kernels *kernels;
    RasterTask *const *task;
    int n;
    int first[16]; // first job of each task in this phase
} Run;

// ---- jobs numbered over several tasks ----

static RasterTask *task_of(const Run *run, int job, int *own)
{
    int t = run->n - 1;
    while (job < run->first[t]) t--;
    *own = job - run->first[t];
    return run->task[t];
}

static void run_phase(Run *run, Threads *threads, ThreadsJob *job, int (*count)(const RasterWork *))
{
    int jobs = 0;
    for (int t = 0; t < run->n; t++) {
        run->first[t] = jobs;
        jobs += count(run->task[t]->work);
    }
    fs_threads_for(threads, jobs, job, run);
}

static int count_chunks(const RasterWork *w)
{
    return w->chunks;
}
static int count_one(const RasterWork *w)
{
    return w->n > 0;
}
static int count_bands(const RasterWork *w)
{
    return w->tiles_y;
}
static int count_tiles(const RasterWork *w)
{
    return w->tiles_x * w->tiles_y;
}

static int chunk_end(const RasterWork *w, int begin)
{
    return begin + CHUNK < w->n ? begin + CHUNK : w->n;
}

// ---- phase 1: project ----

static ProjectParams params_of(float *const field[CLOUD_FIELDS])
{
    return (ProjectParams){field[CLOUD_MEANS], field[CLOUD_SCALES], field[CLOUD_QUATS], field[CLOUD_OPACITIES]};
}

static void project_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    RasterWork *w = task->work;
    int begin = own * CHUNK, end = chunk_end(w, begin), colors = task->colors;
    ProjectParams params = params_of(task->cloud->field);
    run->kernels->project->forward(&w->camera, &params, begin, end, FS_T_MIN, w->splats);
    const float *color = task->cloud->field[CLOUD_COLORS];
    if (task->light) {
        run->kernels->shade->forward(task->light, params.means, color, task->cloud->field[CLOUD_GAINS], begin, end,
                                     w->shaded);
        color = w->shaded;
    }
    for (int i = begin; i < end; i++) {
        Splat *s = &w->splats[i];
        for (int c = 0; c < colors; c++) s->feature[c] = color[(size_t)i * (size_t)colors + (size_t)c];
        if (task->depth) s->feature[colors] = s->depth;
        if (task->train) task->seen[i] = s->tile[0] < s->tile[2];
    }
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
    RasterWork *w = task->work;
    int n = 0;
    memset(w->band_splat_start, 0, sizeof(int) * (size_t)(w->tiles_y + 1));
    memset(w->band_bound, 0, sizeof(int) * (size_t)(w->tiles_y + 1));
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
    RasterWork *w = task->work;
    int *at = w->tile_count; // borrowed: tiles_y <= tiles
    memcpy(at, w->band_splat_start, sizeof(int) * (size_t)w->tiles_y);
    for (int i = 0; i < task->n_visible; i++) {
        uint32_t id = w->spare[i];
        if (i + 16 < task->n_visible) __builtin_prefetch(&w->splats[w->spare[i + 16]]);
        for (int y = w->splats[id].tile[1]; y < w->splats[id].tile[3]; y++) w->band_splat[at[y]++] = id;
    }
    memset(w->tile_count, 0, sizeof(int) * (size_t)(w->tiles_x * w->tiles_y));
}

// ---- phase 3: which rows of which tiles each splat touches ----

static void band_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int y;
    RasterWork *w = task_of(run, job, &y)->work;
    BandEntry *out = w->band_entry + w->band_bound[y];
    int *count = w->tile_count + y * w->tiles_x, rows = w->camera.height - y * FS_TILE_H;
    const uint32_t inside = rows < FS_TILE_H ? (1u << rows) - 1 : 0xffffffffu;
    for (int i = w->band_splat_start[y]; i < w->band_splat_start[y + 1]; i++) {
        uint32_t id = w->band_splat[i];
        const Splat *s = &w->splats[id];
        if (i + 8 < w->band_splat_start[y + 1]) __builtin_prefetch(&w->splats[w->band_splat[i + 8]]);
        uint32_t mask[64];
        for (int x0 = s->tile[0]; x0 < s->tile[2]; x0 += 64) {
            int tiles = s->tile[2] - x0 < 64 ? s->tile[2] - x0 : 64;
            run->kernels->raster->cover(s, x0 * FS_TILE_W, y * FS_TILE_H, tiles, FS_T_MIN, mask);
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
    RasterWork *w = task_of(context, job, &y)->work;
    int *at = w->tile_count + y * w->tiles_x;
    memcpy(at, w->tile_start + y * w->tiles_x, sizeof(int) * (size_t)w->tiles_x);
    const BandEntry *in = w->band_entry + w->band_bound[y];
    for (int i = 0, n = w->band_entries[y]; i < n; i++)
        w->entry[at[in[i].tile_x]++] = (TileEntry){in[i].splat, in[i].mask, 0};
}

// Numbers the gradient records by splat: what backward writes all over, the sums then read in order.
static void number_records(RasterWork *w)
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
    const RasterWork *w = task->work;
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

static void tile_to_planes(const RasterTile *tile, const float *from, const Planes *to)
{
    for (int c = 0; c < to->channels; c++)
        for (int y = 0; y < FS_TILE_H && tile->y0 + y < to->height; y++)
            memcpy(fs_planes_row(to, c, tile->y0 + y) + tile->x0, from + c * FS_TILE_PIXELS + y * FS_TILE_W,
                   sizeof(float) * FS_TILE_W);
}

static void planes_to_tile(const RasterTile *tile, const Planes *from, float *to) // 0 outside the image
{
    int columns = from->width - tile->x0 < FS_TILE_W ? from->width - tile->x0 : FS_TILE_W;
    int rows = from->height - tile->y0 < FS_TILE_H ? from->height - tile->y0 : FS_TILE_H;
    bool whole = columns == FS_TILE_W && rows == FS_TILE_H;
    if (!whole) memset(to, 0, sizeof(float) * FS_TILE_PIXELS * (size_t)from->channels);
    for (int c = 0; c < from->channels; c++)
        for (int y = 0; y < rows; y++) {
            const float *in = fs_planes_row(from, c, tile->y0 + y) + tile->x0;
            float *out = to + c * FS_TILE_PIXELS + y * FS_TILE_W;
            if (whole)
                memcpy(out, in, sizeof(float) * FS_TILE_W);
            else
                memcpy(out, in, sizeof(float) * (size_t)columns);
        }
}

static int count_forward(const RasterWork *w)
{
    return 1 + count_tiles(w);
}

// The first job of a task is not a tile: it does for backward what cannot be shared, while the others go on.
static void forward_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    if (own == 0) {
        if (task->train) number_records(task->work);
        return;
    }
    own--;
    RasterTile tile = tile_of(task, own);
    _Alignas(64) float feature[FS_FEATURES_MAX * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS];
    task->work->tile_pairs[own] = run->kernels->raster->forward(&tile, feature, transmittance);
    tile_to_planes(&tile, feature, &task->feature);
    tile_to_planes(&tile, transmittance, &task->transmittance);
}

// ---- phase 5: backward ----

static void backward_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    RasterTile tile = tile_of(task, own);
    _Alignas(64) float feature[FS_FEATURES_MAX * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS];
    _Alignas(64) float d_feature[FS_FEATURES_MAX * FS_TILE_PIXELS], d_transmittance[FS_TILE_PIXELS];
    if (!tile.n) return;
    planes_to_tile(&tile, &task->feature, feature);
    planes_to_tile(&tile, &task->d_feature, d_feature);
    if (task->use_d_transmittance) {
        planes_to_tile(&tile, &task->transmittance, transmittance);
        planes_to_tile(&tile, &task->d_transmittance, d_transmittance);
    }
    run->kernels->raster->backward(&tile, feature, task->use_d_transmittance ? transmittance : NULL, d_feature,
                                   task->use_d_transmittance ? d_transmittance : NULL, task->work->record);
}

static void reduce_job(void *context, int job, int worker)
{
    (void)worker;
    Run *run = context;
    int own;
    RasterTask *task = task_of(run, job, &own);
    RasterWork *w = task->work;
    int begin = own * CHUNK, end = chunk_end(w, begin), colors = task->colors;
    float *d_color = task->light ? w->d_shaded : task->d_field[CLOUD_COLORS];
    for (int i = begin; i < end; i++) {
        float sum[FS_RECORD] = {0};
        for (int p = w->slot_start[i]; p < w->slot_start[i + 1]; p++) {
            const float *record = w->record + (size_t)p * FS_RECORD;
            for (int k = 0; k < FS_RECORD; k++) sum[k] += record[k];
        }
        memcpy(w->moment + (size_t)i * FS_RECORD, sum, sizeof sum);
        for (int c = 0; c < colors; c++) d_color[(size_t)i * (size_t)colors + (size_t)c] = sum[6 + c];
        w->d_depth[i] = task->depth ? sum[6 + colors] : 0;
        const Splat *p = &w->splats[i];
        float dx = 2 * p->a * sum[1] + p->b * sum[2], dy = 2 * p->c * sum[2] + p->b * sum[1];
        dx *= 0.5f * (float)w->camera.width;
        dy *= 0.5f * (float)w->camera.height;
        task->d_screen[i] = task->seen[i] ? sqrtf(dx * dx + dy * dy) : 0;
    }
    ProjectParams params = params_of(task->cloud->field), gradients = params_of(task->d_field);
    run->kernels->project->backward(&w->camera, &params, begin, end, w->splats, w->moment, w->d_depth, &gradients);
    if (task->light)
        run->kernels->shade->backward(task->light, params.means, task->cloud->field[CLOUD_COLORS],
                                      task->cloud->field[CLOUD_GAINS], begin, end, d_color, task->d_field[CLOUD_COLORS],
                                      task->d_field[CLOUD_GAINS], w->chunk_tint[own]);
    else if (task->cloud->width[CLOUD_GAINS])
        memset(task->d_field[CLOUD_GAINS] + begin, 0, sizeof(float) * (size_t)(end - begin));
}

// ---- setting up ----

static ProjectCamera project_camera(const Camera *camera, float near)
{
    ProjectCamera c = {.fx = (float)camera->fx,
                       .fy = (float)camera->fy,
                       .cx = (float)camera->cx,
                       .cy = (float)camera->cy,
                       .near = near,
                       .width = camera->width,
                       .height = camera->height};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) c.rotation[3 * i + k] = (float)camera->w2c[4 * i + k];
        c.translation[i] = (float)camera->w2c[4 * i + 3];
    }
    c.limit_x = 1.3f * 0.5f * (float)camera->width / c.fx;
    c.limit_y = 1.3f * 0.5f * (float)camera->height / c.fy;
    return c;
}

static Planes new_planes(Arena *arena, const Camera *camera, int channels)
{
    Planes p = {camera->width, camera->height, channels, fs_planes_stride(camera->width), NULL};
    p.px = ARENA_NEW(arena, float, (size_t)channels *(size_t)p.height *(size_t)p.stride);
    return p;
}

static void set_up(RasterTask *task, const Camera *camera, float near)
{
    Arena *a = &task->arena;
    fs_arena_reset(a);
    RasterWork *w = task->work = ARENA_NEW(a, RasterWork, 1);
    int n = task->cloud->n, tx = (camera->width + FS_TILE_W - 1) / FS_TILE_W;
    int ty = (camera->height + FS_TILE_H - 1) / FS_TILE_H;
    *w = (RasterWork){.camera = project_camera(camera, near),
                      .near = near,
                      .n = n,
                      .tiles_x = tx,
                      .tiles_y = ty,
                      .chunks = (n + CHUNK - 1) / CHUNK};
    w->splats = ARENA_NEW(a, Splat, n);
    if (task->light) w->shaded = ARENA_NEW(a, float, 3 * (size_t)n);
    w->order = ARENA_NEW(a, uint32_t, n);
    w->spare = ARENA_NEW(a, uint32_t, n);
    w->key = ARENA_NEW(a, uint32_t, n);
    w->spare_key = ARENA_NEW(a, uint32_t, n);
    w->band_splat_start = ARENA_NEW(a, int, ty + 1);
    w->band_bound = ARENA_NEW(a, int, ty + 1);
    w->band_entries = ARENA_NEW(a, int, ty);
    w->tile_start = ARENA_NEW(a, int, tx *ty + 1);
    w->tile_count = ARENA_NEW(a, int, tx *ty);
    w->tile_pairs = ARENA_NEW(a, long, tx *ty);
    memset(w->band_splat_start, 0, sizeof(int) * (size_t)(ty + 1));
    memset(w->band_bound, 0, sizeof(int) * (size_t)(ty + 1));
    task->n_visible = 0;
    task->feature = new_planes(a, camera, task->colors + task->depth);
    task->transmittance = new_planes(a, camera, 1);
    if (!task->train) return;
    task->d_feature = new_planes(a, camera, task->colors + task->depth);
    task->d_transmittance = new_planes(a, camera, 1);
    task->seen = ARENA_NEW(a, unsigned char, n);
    task->d_screen = ARENA_NEW(a, float, n);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        task->d_field[f] =
            task->cloud->width[f] ? ARENA_NEW(a, float, (size_t)task->cloud->width[f] * (size_t)n) : NULL;
    w->slot_start = ARENA_NEW(a, int, n + 1);
    w->moment = ARENA_NEW(a, float, (size_t)n *FS_RECORD);
    w->d_depth = ARENA_NEW(a, float, n);
    if (task->light) {
        w->d_shaded = ARENA_NEW(a, float, 3 * (size_t)n);
        w->chunk_tint = (double(*)[3])fs_arena_alloc(a, sizeof(double[3]) * (size_t)(w->chunks + 1));
    }
}

// Tile starts from tile counts; makes room for the entries.
static void place_tiles(RasterTask *task)
{
    RasterWork *w = task->work;
    w->tile_start[0] = 0;
    for (int t = 0; t < w->tiles_x * w->tiles_y; t++) w->tile_start[t + 1] = w->tile_start[t] + w->tile_count[t];
    w->n_entries = w->tile_start[w->tiles_x * w->tiles_y];
    w->entry = ARENA_NEW(&task->arena, TileEntry, w->n_entries);
    if (!task->train) return;
    w->record = ARENA_NEW(&task->arena, float, (size_t)w->n_entries *FS_RECORD);
}

void fs_raster_task_forward(const Kernels *kernels, Threads *threads, RasterTask *const *task, int n,
                            const Camera *camera, float near)
{
    Run run = {.kernels = kernels, .task = task, .n = n};
    for (int t = 0; t < n; t++) set_up(task[t], camera, near);
    run_phase(&run, threads, project_job, count_chunks);
    run_phase(&run, threads, sort_job, count_one);
    for (int t = 0; t < n; t++) {
        RasterWork *w = task[t]->work;
        w->band_splat = ARENA_NEW(&task[t]->arena, uint32_t, w->band_splat_start[w->tiles_y]);
        w->band_entry = ARENA_NEW(&task[t]->arena, BandEntry, w->band_bound[w->tiles_y]);
        if (!w->n) memset(w->tile_count, 0, sizeof(int) * (size_t)(w->tiles_x * w->tiles_y));
    }
    run_phase(&run, threads, list_job, count_one);
    run_phase(&run, threads, band_job, count_bands);
    for (int t = 0; t < n; t++) place_tiles(task[t]);
    run_phase(&run, threads, scatter_job, count_bands);
    run_phase(&run, threads, forward_job, count_forward);
    for (int t = 0; t < n; t++) {
        task[t]->pairs = 0;
        for (int i = 0; i < count_tiles(task[t]->work); i++) task[t]->pairs += task[t]->work->tile_pairs[i];
    }
}

void fs_raster_task_backward(const Kernels *kernels, Threads *threads, RasterTask *const *task, int n)
{
    Run run = {.kernels = kernels, .task = task, .n = n};
    for (int t = 0; t < n; t++)
        if (task[t]->light) memset(task[t]->work->chunk_tint, 0, sizeof(double[3]) * (size_t)task[t]->work->chunks);
    run_phase(&run, threads, backward_job, count_tiles);
    run_phase(&run, threads, reduce_job, count_chunks);
    for (int t = 0; t < n; t++)
        for (int k = 0; k < 3; k++) {
            task[t]->d_tint[k] = 0;
            for (int c = 0; task[t]->light && c < task[t]->work->chunks; c++)
                task[t]->d_tint[k] += task[t]->work->chunk_tint[c][k];
        }
}

void fs_raster_task_free(RasterTask *task)
{
    fs_arena_free(&task->arena);
    *task = (RasterTask){0};
}

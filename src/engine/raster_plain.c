// The rasteriser as its definition reads: every visible splat, in order of depth, is an entry of every tile. Slow; what
// the others are held against.
#include "engine/raster_pass.h"

#include <stdlib.h>
#include <string.h>

typedef struct Depth {
    float depth;
    uint32_t splat;
} Depth;

static int nearer(const void *a, const void *b) // ties by number, as a stable sort leaves them
{
    const Depth *x = a, *y = b;
    if (x->depth != y->depth) return x->depth < y->depth ? -1 : 1;
    return (x->splat > y->splat) - (x->splat < y->splat);
}

// The visible splats; NULL when out of memory.
static TileEntry *entries_of(RasterTask *task)
{
    const RasterWork *w = task->work;
    Depth *order = ARENA_NEW(&task->arena, Depth, w->n);
    TileEntry *entry = ARENA_NEW(&task->arena, TileEntry, w->n);
    if (task->arena.failed) return NULL;
    task->n_visible = 0;
    for (int i = 0; i < w->n; i++)
        if (w->splats[i].tile[0] < w->splats[i].tile[2])
            order[task->n_visible++] = (Depth){w->splats[i].depth, (uint32_t)i};
    qsort(order, (size_t)task->n_visible, sizeof *order, nearer);
    for (int i = 0; i < task->n_visible; i++)
        entry[i] = (TileEntry){order[i].splat, 0xffffffffu, (uint32_t)i}; // every row
    return entry;
}

static RasterTile tile_at(const RasterTask *task, const TileEntry *entry, int x0, int y0)
{
    return (RasterTile){.x0 = x0,
                        .y0 = y0,
                        .n = task->n_visible,
                        .entry = entry,
                        .splats = task->work->splats,
                        .features = fs_raster_pass_features(task),
                        .t_min = FS_T_MIN,
                        .transmittance_min = FS_TRANSMITTANCE_MIN,
                        .count = task->count,
                        .median = task->median};
}

static int forward(const RasterPass *pass, FsError *err)
{
    for (int t = 0; t < pass->n; t++) {
        RasterTask *task = pass->task[t];
        fs_raster_pass_set_up(task, pass);
        if (task->arena.failed) return fs_error_memory(err);
        for (int c = 0; c < task->work->chunks; c++) fs_raster_pass_project(task, pass->kernels, c);
        const TileEntry *entry = entries_of(task);
        if (task->train) task->work->records = ARENA_NEW(&task->arena, float, (size_t)task->n_visible *FS_RECORD);
        if (task->arena.failed) return fs_error_memory(err);
        task->work->entry = entry;
        task->pairs = 0;
        for (int y = 0; y < pass->camera->height; y += FS_TILE_H)
            for (int x = 0; x < pass->camera->width; x += FS_TILE_W) {
                RasterTile tile = tile_at(task, entry, x, y);
                long pairs;
                fs_raster_pass_tile_forward(pass->kernels, task, &tile, &pairs);
                task->pairs += pairs;
            }
    }
    return 0;
}

static void backward(const RasterPass *pass)
{
    for (int t = 0; t < pass->n; t++) {
        RasterTask *task = pass->task[t];
        RasterWork *w = task->work;
        memset(w->moment, 0, sizeof(float) * FS_RECORD * (size_t)w->n);
        for (int y = 0; y < pass->camera->height; y += FS_TILE_H)
            for (int x = 0; x < pass->camera->width; x += FS_TILE_W) {
                RasterTile tile = tile_at(task, w->entry, x, y);
                fs_raster_pass_tile_backward(pass->kernels, task, &tile, w->records);
                for (int i = 0; i < task->n_visible; i++)
                    for (int k = 0; k < FS_RECORD; k++)
                        w->moment[(size_t)w->entry[i].splat * FS_RECORD + (size_t)k] +=
                            w->records[(size_t)i * FS_RECORD + (size_t)k];
            }
        for (int c = 0; c < w->chunks; c++) fs_raster_pass_gradients(task, pass->kernels, c);
        fs_raster_pass_sum_tint(task);
    }
}

const Rasteriser fs_raster_plain = {forward, backward};

#include "engine/raster_pass.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "engine/scratch.h"

void fs_raster_pass_add(RasterPass *pass, RasterTask *task)
{
    assert(pass->n < RASTER_TASKS_MAX);
    pass->task[pass->n++] = task;
}

void fs_raster_pass_free_task(RasterTask *task)
{
    fs_arena_free(&task->arena);
    *task = (RasterTask){0};
}

int fs_raster_pass_chunk_end(const RasterWork *work, int chunk)
{
    return work->n - chunk * RASTER_CHUNK < RASTER_CHUNK ? work->n : (chunk + 1) * RASTER_CHUNK;
}

// ---- before the tiles ----

static ProjectParams params_of(float *const field[CLOUD_FIELDS])
{
    return (ProjectParams){field[CLOUD_MEANS], field[CLOUD_SCALES], field[CLOUD_QUATS], field[CLOUD_OPACITIES]};
}

static ShadeCloud shade_cloud(const Cloud *cloud)
{
    return (ShadeCloud){cloud->field[CLOUD_MEANS], cloud->field[CLOUD_COLORS], cloud->field[CLOUD_GAINS]};
}

// A photo's pixel is as large as it is, however many of them are looked at.
static float dilation(int stride)
{
    return stride > 1 ? FS_COV_DILATION / (float)(stride * stride) : FS_COV_DILATION;
}

static ProjectCamera project_camera(const RasterPass *pass)
{
    const Camera *camera = pass->camera;
    ProjectCamera c = {.fx = (float)camera->fx,
                       .fy = (float)camera->fy,
                       .cx = (float)camera->cx,
                       .cy = (float)camera->cy,
                       .near = pass->near,
                       .width = camera->width,
                       .height = camera->height,
                       .dilation_x = dilation(pass->stride[0]),
                       .dilation_y = dilation(pass->stride[1])};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) c.rotation[3 * i + k] = (float)camera->w2c[4 * i + k];
        c.translation[i] = (float)camera->w2c[4 * i + 3];
    }
    c.limit_x = 1.3f * 0.5f * (float)camera->width / c.fx;
    c.limit_y = 1.3f * 0.5f * (float)camera->height / c.fy;
    return c;
}

static void set_up_backward(RasterTask *task, const Camera *camera)
{
    Arena *a = &task->arena;
    RasterWork *w = task->work;
    int n = w->n;
    task->d_feature = fs_scratch_planes(a, camera, fs_raster_pass_features(task));
    task->d_transmittance = fs_scratch_planes(a, camera, 1);
    task->seen = ARENA_NEW(a, unsigned char, n);
    task->d_screen = ARENA_NEW(a, float, n);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        task->d_field[f] =
            task->cloud->width[f] ? ARENA_NEW(a, float, (size_t)task->cloud->width[f] * (size_t)n) : NULL;
    w->moment = ARENA_NEW(a, float, (size_t)n *FS_RECORD);
    w->d_depth = ARENA_NEW(a, float, n);
    if (!task->light) return;
    w->d_shaded = ARENA_NEW(a, float, 3 * (size_t)n);
    w->chunk_tint = (double(*)[3])fs_arena_alloc(a, sizeof(double[3]) * (size_t)(w->chunks + 1));
}

void fs_raster_pass_set_up(RasterTask *task, const RasterPass *pass)
{
    const Camera *camera = pass->camera;
    Arena *a = &task->arena;
    fs_arena_reset(a);
    int n = task->cloud->n;
    RasterWork *w = task->work = ARENA_NEW(a, RasterWork, 1);
    if (!w) return;
    *w = (RasterWork){.camera = project_camera(pass), .n = n, .chunks = (n + RASTER_CHUNK - 1) / RASTER_CHUNK};
    w->splats = ARENA_NEW(a, Splat, n);
    if (task->light) w->shaded = ARENA_NEW(a, float, 3 * (size_t)n);
    task->n_visible = 0;
    task->feature = fs_scratch_planes(a, camera, fs_raster_pass_features(task));
    task->transmittance = fs_scratch_planes(a, camera, 1);
    if (task->train) set_up_backward(task, camera);
}

void fs_raster_pass_project(RasterTask *task, const Kernels *kernels, int chunk)
{
    RasterWork *w = task->work;
    int begin = chunk * RASTER_CHUNK, end = fs_raster_pass_chunk_end(w, chunk), colors = task->colors;
    ProjectParams params = params_of(task->cloud->field);
    kernels->project->forward(&w->camera, &params, begin, end, FS_T_MIN, w->splats);
    const float *color = task->cloud->field[CLOUD_COLORS];
    if (task->light) {
        ShadeCloud cloud = shade_cloud(task->cloud);
        kernels->shade->forward(task->light, &cloud, begin, end, w->shaded);
        color = w->shaded;
    }
    for (int i = begin; i < end; i++) {
        Splat *s = &w->splats[i];
        for (int c = 0; c < colors; c++) s->feature[c] = color[(size_t)i * (size_t)colors + (size_t)c];
        if (task->depth) s->feature[colors] = s->depth;
        if (task->cover) s->feature[colors] = task->cloud->field[CLOUD_COVERS][i];
        if (task->train) task->seen[i] = s->tile[0] < s->tile[2];
    }
}

// ---- one tile ----

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

void fs_raster_pass_tile_forward(const Kernels *kernels, RasterTask *task, const RasterTile *tile, long *pairs)
{
    _Alignas(64) float feature[FS_FEATURES_MAX * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS];
    *pairs = kernels->raster->forward(tile, feature, transmittance);
    tile_to_planes(tile, feature, &task->feature);
    tile_to_planes(tile, transmittance, &task->transmittance);
}

void fs_raster_pass_tile_backward(const Kernels *kernels, RasterTask *task, const RasterTile *tile, float *records)
{
    _Alignas(64) float feature[FS_FEATURES_MAX * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS];
    _Alignas(64) float d_feature[FS_FEATURES_MAX * FS_TILE_PIXELS], d_transmittance[FS_TILE_PIXELS];
    planes_to_tile(tile, &task->feature, feature);
    planes_to_tile(tile, &task->d_feature, d_feature);
    if (task->use_d_transmittance) {
        planes_to_tile(tile, &task->transmittance, transmittance);
        planes_to_tile(tile, &task->d_transmittance, d_transmittance);
    }
    kernels->raster->backward(tile, feature, task->use_d_transmittance ? transmittance : NULL, d_feature,
                              task->use_d_transmittance ? d_transmittance : NULL, records);
}

// ---- after the tiles ----

void fs_raster_pass_gradients(RasterTask *task, const Kernels *kernels, int chunk)
{
    RasterWork *w = task->work;
    int begin = chunk * RASTER_CHUNK, end = fs_raster_pass_chunk_end(w, chunk), colors = task->colors;
    float *d_color = task->light ? w->d_shaded : task->d_field[CLOUD_COLORS];
    for (int i = begin; i < end; i++) {
        const float *sum = w->moment + (size_t)i * FS_RECORD;
        for (int c = 0; c < colors; c++) d_color[(size_t)i * (size_t)colors + (size_t)c] = sum[6 + c];
        w->d_depth[i] = task->depth ? sum[6 + colors] : 0;
        if (task->cloud->width[CLOUD_COVERS]) task->d_field[CLOUD_COVERS][i] = task->cover ? sum[6 + colors] : 0;
        const Splat *p = &w->splats[i];
        float dx = 2 * p->a * sum[1] + p->b * sum[2], dy = 2 * p->c * sum[2] + p->b * sum[1];
        dx *= 0.5f * (float)w->camera.width;
        dy *= 0.5f * (float)w->camera.height;
        task->d_screen[i] = task->seen[i] ? sqrtf(dx * dx + dy * dy) : 0;
    }
    ProjectParams params = params_of(task->cloud->field), gradients = params_of(task->d_field);
    ProjectBack from = {w->splats, w->moment, w->d_depth};
    kernels->project->backward(&w->camera, &params, begin, end, &from, &gradients);
    if (task->light) {
        memset(w->chunk_tint[chunk], 0, sizeof w->chunk_tint[chunk]);
        ShadeCloud cloud = shade_cloud(task->cloud);
        ShadeGradients d = {task->d_field[CLOUD_COLORS], task->d_field[CLOUD_GAINS]};
        kernels->shade->backward(task->light, &cloud, begin, end, d_color, &d, w->chunk_tint[chunk]);
    } else if (task->cloud->width[CLOUD_GAINS]) {
        memset(task->d_field[CLOUD_GAINS] + begin, 0, sizeof(float) * (size_t)(end - begin));
    }
}

void fs_raster_pass_sum_tint(RasterTask *task)
{
    for (int k = 0; k < 3; k++) {
        task->d_tint[k] = 0;
        for (int c = 0; task->light && c < task->work->chunks; c++) task->d_tint[k] += task->work->chunk_tint[c][k];
    }
}

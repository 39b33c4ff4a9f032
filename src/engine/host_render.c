// Renders all layers of a view.
#include "engine/host_engine.h"

#include "base/threads.h"

typedef struct Render {
    HostEngine *engine;
    ViewImages images[2]; // without and with flash
    int height;
} Render;

static void strip_job(void *context, int strip, int worker)
{
    (void)worker;
    const Render *r = context;
    int end = fs_host_engine_strip_end(r->engine, strip, r->height);
    for (int f = 0; f < 2; f++) fs_view_images_forward(&r->images[f], strip * r->engine->strip, end);
}

// ---- planes to images ----

static int to_image(const Planes *planes, const Planes *times, Image *image, int channels, FsError *err)
{
    if (image->width != planes->width || image->height != planes->height || image->channels != channels) {
        fs_image_free(image);
        int rc = fs_image_new(image, planes->width, planes->height, channels, err);
        if (rc < 0) return rc;
    }
    for (int y = 0; y < planes->height; y++)
        for (int c = 0; c < channels; c++) {
            const float *row = fs_planes_row(planes, c, y), *by = times ? fs_planes_row(times, 0, y) : NULL;
            float *px = image->px + (size_t)y * (size_t)planes->width * (size_t)channels + c;
            for (int x = 0; x < planes->width; x++) px[x * channels] = row[x] * (by ? by[x] : 1);
        }
    return 0;
}

// 0 where there is no such part, or less than half of the light is stopped.
static int to_depth(const RasterTask *task, const Camera *camera, Image *image, FsError *err)
{
    if (!task) {
        fs_image_free(image);
        return fs_image_new(image, camera->width, camera->height, 1, err);
    }
    Planes depth = fs_view_images_last(task, &task->feature);
    return to_image(&depth, NULL, image, 1, err);
}

static int to_images(const Render *r, const Camera *camera, Renders *renders, FsError *err)
{
    const ViewImages *N = &r->images[0], *F = &r->images[1];
    const struct {
        RenderLayer layer;
        const Planes *planes, *times;
    } copies[] = {
        {RENDER_T_N, &N->T_linear, NULL},     {RENDER_T_F, &F->T_linear, NULL},  {RENDER_R, &N->R_linear, &N->beta_map},
        {RENDER_R_SCENE, &N->R_linear, NULL}, {RENDER_BETA, &N->beta_map, NULL}, {RENDER_I_N, &N->I_linear, NULL},
        {RENDER_I_F, &F->I_linear, NULL},
    };
    int rc = 0;
    for (size_t i = 0; i < sizeof copies / sizeof *copies && rc == 0; i++)
        rc = to_image(copies[i].planes, copies[i].times, &renders->layer[copies[i].layer],
                      fs_render_layers[copies[i].layer].channels, err);
    if (rc == 0) rc = to_depth(N->T, camera, &renders->layer[RENDER_DEPTH_T], err);
    if (rc == 0) rc = to_depth(N->R, camera, &renders->layer[RENDER_DEPTH_R], err);
    return rc;
}

// ---- what is rasterised ----

static RasterTask *add(HostEngine *e, RasterPass *pass, int number, const PlanPart *part)
{
    static const Cloud empty; // of a part that the scene lacks, where the images need one
    RasterTask *task = fs_host_engine_task(e, number, part);
    if (!task->cloud && !fs_radiance_is(&e->scene.field)) task->cloud = &empty;
    task->depth = task->median = number == TASK_T || number == TASK_R;
    fs_raster_pass_add(pass, task);
    return task;
}

int fs_host_render(Engine *base, const Camera *camera, Renders *renders, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    Render r = {.engine = e, .height = camera->height};
    RasterPass pass = {&e->kernels, e->threads, {NULL}, 0, camera, (float)(FS_NEAR * e->scene.extent), &e->volumes, 0};
    ViewImages *N = &r.images[0], *F = &r.images[1];
    for (int f = 0; f < 2; f++) r.images[f].plan = fs_view_plan(&e->scene, camera, f == 1);
    fs_arena_reset(&e->arena);
    N->T = add(e, &pass, TASK_T, &N->plan.T);
    F->T = F->plan.T.layer == N->plan.T.layer && !F->plan.T.lit ? N->T : add(e, &pass, TASK_OTHER_T, &F->plan.T);
    if (N->plan.R.there) N->R = add(e, &pass, TASK_R, &N->plan.R);
    F->R = N->R && F->plan.R.lit ? add(e, &pass, TASK_LIT_R, &F->plan.R) : N->R;
    if (N->plan.beta.there) N->beta = F->beta = add(e, &pass, TASK_BETA, &N->plan.beta);
    if (N->plan.covers && F->T != N->T) { // N's has the depth
        F->T->cover = true;
        N->cover = F->cover = F->T;
    }
    for (int f = 0; f < 2; f++) fs_view_images_set_up(&r.images[f], &e->kernels, &e->arena, camera, false);
    if (e->arena.failed) return fs_error_memory(err);
    int rc = fs_host_engine_raster(e)->forward(&pass, err);
    if (rc < 0) return rc;
    fs_threads_for(e->threads, fs_host_engine_strips(e, camera->height), strip_job, &r);
    return to_images(&r, camera, renders, err);
}

#include "engine/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/threads.h"
#include "engine/internal.h"

#define STRIP 16 // rows per job

const RenderLayerInfo fs_render_layers[RENDER_LAYERS] = {
    [RENDER_T_N] = {"T_N", 3, false},
    [RENDER_T_F] = {"T_F", 3, false},
    [RENDER_R] = {"R", 3, false},
    [RENDER_R_SCENE] = {"R_scene", 3, false},
    [RENDER_BETA] = {"beta", 1, false},
    [RENDER_I_N] = {"I_N", 3, false},
    [RENDER_I_F] = {"I_F", 3, false},
    [RENDER_DEPTH_T] = {"depth_T", 1, true},
    [RENDER_DEPTH_R] = {"depth_R", 1, true},
};

int fs_engine_new(Engine **out, const char *cpu, int threads, FsError *err)
{
    *out = NULL;
    Engine *engine = calloc(1, sizeof *engine);
    if (!engine) return fs_error_memory(err);
    int rc = fs_kernels_choose(cpu, &engine->kernels, err);
    if (rc == 0 && !(engine->threads = fs_threads_new(threads))) rc = fs_error_memory(err);
    if (rc < 0) {
        fs_engine_free(engine);
        return rc;
    }
    *out = engine;
    return 0;
}

void fs_engine_free(Engine *engine)
{
    if (!engine) return;
    for (int l = 0; l < LAYERS; l++) fs_raster_task_free(&engine->task[l]);
    fs_raster_task_free(&engine->lit_R);
    fs_arena_free(&engine->arena);
    fs_threads_free(engine->threads);
    free(engine);
}

Planes fs_engine_planes(Engine *engine, const Camera *camera, int channels)
{
    Planes p = {camera->width, camera->height, channels, fs_planes_stride(camera->width), NULL};
    p.px = ARENA_NEW(&engine->arena, float, (size_t)channels *(size_t)p.height *(size_t)p.stride);
    return p;
}

ShadeLight fs_engine_light(const Scene *scene, const Camera *camera)
{
    ShadeLight light = {.flash_distance = (float)scene->flash_distance, .even = scene->separation == SEPARATION_LINEAR};
    double centre[3];
    fs_camera_centre(camera, centre);
    for (int k = 0; k < 3; k++) {
        light.centre[k] = (float)centre[k];
        light.tint[k] = (float)scene->gain_color[k];
    }
    return light;
}

ShadeLight fs_engine_return(const Scene *scene, const Camera *camera)
{
    ShadeLight light = fs_engine_light(scene, camera);
    for (int k = 0; k < 3; k++) light.tint[k] *= (float)scene->flash_return;
    return light;
}

// ---- rendering all layers of a view ----

typedef struct View {
    Engine *engine;
    const Scene *scene;
    const Camera *camera;
    Planes T[2], R[2], beta, tau; // without and with flash; T, R tone-mapped
    Planes linear[4], I[2], I_linear[2];
    Renders *out;
} View;

static void compose_job(void *context, int job, int worker)
{
    (void)worker;
    View *v = context;
    int y0 = job * STRIP, y1 = y0 + STRIP < v->camera->height ? y0 + STRIP : v->camera->height;
    if (v->scene->pane_beta) {
        PaneView pane = fs_pane_view(&v->scene->pane, v->camera);
        v->engine->kernels.pane->forward(&pane, &v->beta, &v->tau, y0, y1);
    } else {
        fs_engine_sigmoid(&v->engine->task[LAYER_BETA].feature, &v->beta, y0, y1);
    }
    for (int f = 0; f < 2; f++) {
        ComposeArgs args = {.T = &v->T[f],
                            .R = &v->R[f],
                            .beta = &v->beta,
                            .I = &v->I[f],
                            .T_linear = &v->linear[f],
                            .R_linear = &v->linear[2 + f],
                            .I_linear = &v->I_linear[f],
                            .tau = v->scene->pane_beta ? &v->tau : NULL};
        v->engine->kernels.compose->forward(&args, y0, y1);
    }
}

void fs_engine_sigmoid(const Planes *logit, const Planes *out, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *in = fs_planes_row(logit, 0, y);
        float *row = fs_planes_row(out, 0, y);
        for (int x = 0; x < out->stride; x++) row[x] = 1 / (1 + expf(-in[x]));
    }
}

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

static int to_depth(const RasterTask *task, Image *image, FsError *err)
{
    Planes depth = task->feature;
    depth.px = fs_planes_row(&task->feature, task->colors, 0);
    int rc = to_image(&depth, NULL, image, 1, err);
    for (int y = 0; y < depth.height && rc == 0; y++)
        for (int x = 0; x < depth.width; x++) {
            float alpha = 1 - fs_planes_row(&task->transmittance, 0, y)[x];
            float *z = &image->px[(size_t)y * (size_t)depth.width + (size_t)x];
            *z = alpha >= 0.5f ? *z / alpha : 0;
        }
    return rc;
}

int fs_engine_render(Engine *engine, const Scene *scene, const Camera *camera, Renders *renders, FsError *err)
{
    fs_arena_reset(&engine->arena);
    ShadeLight light = fs_engine_light(scene, camera), back = fs_engine_return(scene, camera);
    RasterTask *task[LAYERS + 1], *lit_R = &engine->task[LAYER_R];
    int n = 0;
    for (int l = 0; l < LAYERS; l++) {
        if (l == LAYER_BETA && scene->pane_beta) continue;
        bool lit = l == LAYER_T_F && scene->shared_geometry;
        RasterTask *t = task[n++] = &engine->task[l];
        t->cloud = &scene->cloud[lit ? LAYER_T_N : l];
        t->light = lit && fs_scene_lit(scene) ? &light : NULL;
        t->colors = fs_layers[l].channels;
        t->depth = true;
        t->train = false;
    }
    if (fs_scene_lit(scene) && scene->cloud[LAYER_R].n) {
        task[n++] = lit_R = &engine->lit_R;
        lit_R->cloud = &scene->cloud[LAYER_R];
        lit_R->light = &back;
        lit_R->colors = 3;
    }
    fs_raster_task_forward(&engine->kernels, engine->threads, task, n, camera, (float)(FS_ENGINE_NEAR * scene->extent));
    View v = {.engine = engine, .scene = scene, .camera = camera, .out = renders};
    v.T[0] = engine->task[LAYER_T_N].feature;
    v.T[1] = engine->task[LAYER_T_F].feature;
    v.R[0] = engine->task[LAYER_R].feature;
    v.R[1] = lit_R->feature;
    v.T[0].channels = v.T[1].channels = v.R[0].channels = v.R[1].channels = 3;
    v.beta = fs_engine_planes(engine, camera, 1);
    v.tau = fs_engine_planes(engine, camera, 1);
    for (int i = 0; i < 4; i++) v.linear[i] = fs_engine_planes(engine, camera, 3);
    for (int i = 0; i < 2; i++) {
        v.I[i] = fs_engine_planes(engine, camera, 3);
        v.I_linear[i] = fs_engine_planes(engine, camera, 3);
    }
    fs_threads_for(engine->threads, (camera->height + STRIP - 1) / STRIP, compose_job, &v);
    const struct {
        RenderLayer layer;
        const Planes *planes, *times;
    } copies[] = {
        {RENDER_T_N, &v.linear[0], NULL},     {RENDER_T_F, &v.linear[1], NULL}, {RENDER_R, &v.linear[2], &v.beta},
        {RENDER_R_SCENE, &v.linear[2], NULL}, {RENDER_BETA, &v.beta, NULL},     {RENDER_I_N, &v.I_linear[0], NULL},
        {RENDER_I_F, &v.I_linear[1], NULL},
    };
    int rc = 0;
    for (size_t i = 0; i < sizeof copies / sizeof *copies && rc == 0; i++)
        rc = to_image(copies[i].planes, copies[i].times, &renders->layer[copies[i].layer],
                      fs_render_layers[copies[i].layer].channels, err);
    if (rc == 0) rc = to_depth(&engine->task[LAYER_T_N], &renders->layer[RENDER_DEPTH_T], err);
    if (rc == 0) rc = to_depth(&engine->task[LAYER_R], &renders->layer[RENDER_DEPTH_R], err);
    return rc;
}

void fs_renders_free(Renders *renders)
{
    for (int l = 0; l < RENDER_LAYERS; l++) fs_image_free(&renders->layer[l]);
}

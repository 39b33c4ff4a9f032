#include "engine/host_engine.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "image/tone.h"

// ---- opening and closing ----

static int open_host(Engine **out, const HostEngine *as, FsError *err)
{
    HostEngine *engine = malloc(sizeof *engine);
    if (!engine) {
        fs_threads_free(as->threads);
        return fs_error_memory(err);
    }
    *engine = *as;
    *out = &engine->base;
    return 0;
}

static int open_cpu(Engine **out, const char *cpu, int threads, FsError *err)
{
    HostEngine engine = {.raster = &fs_raster_tiles, .strip = 32};
    int rc = fs_kernels_choose(cpu, &engine.kernels, err);
    if (rc < 0) return rc;
    if (!(engine.threads = fs_threads_new(threads))) return fs_error_memory(err);
    return open_host(out, &engine, err);
}

static int open_reference(Engine **out, const char *cpu, int threads, FsError *err)
{
    (void)cpu, (void)threads; // always the scalar definition on the caller's thread
    HostEngine engine = {.raster = &fs_raster_plain, .kernels = fs_kernels_at(CPU_SCALAR)};
    return open_host(out, &engine, err);
}

static void drop_views(Engine *base)
{
    HostEngine *e = fs_host_engine(base);
    for (int i = 0; i < e->base.n_views; i++) {
        free(e->views[i].memory);
        free(e->views[i].occlusion);
    }
}

static void close_host(Engine *base)
{
    HostEngine *e = fs_host_engine(base);
    drop_views(base);
    for (int i = 0; i < HOST_TASKS; i++) fs_raster_pass_free_task(&e->task[i]);
    free(e->views);
    fs_gain_graph_free(&e->graph);
    fs_engine_state_free(&e->state);
    fs_raster_volumes_close(&e->volumes);
    fs_scene_free(&e->scene);
    fs_arena_free(&e->arena);
    fs_threads_free(e->threads);
    free(e);
}

// ---- the scene ----

static int scene_up(Engine *base, const Scene *scene, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    fs_scene_free(&e->scene);
    fs_engine_state_free(&e->state);
    fs_gain_graph_free(&e->graph);
    fs_raster_volumes_close(&e->volumes);
    MUST(fs_scene_copy(&e->scene, scene, err));
    return fs_radiance_is(&scene->field) ? fs_raster_volumes_open(&e->volumes, &e->scene.field, err) : 0;
}

static int scene_down(Engine *base, unsigned layers, Scene *scene, FsError *err)
{
    const HostEngine *e = fs_host_engine(base);
    Scene down = e->scene;
    memcpy(down.cloud, scene->cloud, sizeof down.cloud);
    down.field = scene->field;
    down.veil.light = scene->veil.light;
    *scene = down;
    int rc = 0;
    if (layers && fs_pane_veil_is(&e->scene.veil)) {
        fs_image_free(&scene->veil.light);
        rc = fs_image_copy(&scene->veil.light, &e->scene.veil.light, err);
    }
    if (rc == 0 && layers && fs_radiance_is(&e->scene.field)) {
        fs_radiance_free(&scene->field);
        rc = fs_radiance_copy(&scene->field, &e->scene.field, err);
    }
    for (int l = 0; l < LAYERS && rc == 0; l++) {
        if (!(layers >> l & 1)) continue;
        fs_cloud_free(&scene->cloud[l]);
        if (e->scene.cloud[l].n) rc = fs_cloud_copy(&scene->cloud[l], &e->scene.cloud[l], err);
    }
    return rc;
}

// ---- what training keeps ----

static void take_rows(Cloud *to, const Cloud *from, const int *rows, unsigned forget)
{
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)to->width[f];
        for (int i = 0; i < to->n && w && !(forget >> f & 1); i++) {
            int row = rows ? rows[i] : i;
            if (row >= 0) memcpy(to->field[f] + (size_t)i * w, from->field[f] + (size_t)row * w, sizeof(float) * w);
        }
    }
}

// The state of a cloud like `like`: zero, then the moments of `from` where there is one, of the rows and fields that
// an edit says; without an edit all of it, and the statistics too. `to` is replaced.
static int make_state(CloudState *to, const Cloud *like, const CloudState *from, const CloudEdit *edit, FsError *err)
{
    CloudState state = {.screen = calloc(2 * (size_t)like->n + 1, sizeof(float))};
    int rc = state.screen ? 0 : fs_error_memory(err);
    if (rc == 0) rc = fs_cloud_new_like(&state.m, like, like->n, err);
    if (rc == 0) rc = fs_cloud_new_like(&state.v, like, like->n, err);
    if (rc == 0 && from) {
        take_rows(&state.m, &from->m, edit ? edit->from : NULL, edit ? edit->forget : 0);
        take_rows(&state.v, &from->v, edit ? edit->from : NULL, edit ? edit->forget : 0);
        if (!edit && from->screen) memcpy(state.screen, from->screen, sizeof(float) * 2 * (size_t)like->n);
    }
    CloudState gone = rc == 0 ? *to : state;
    if (rc == 0) *to = state;
    fs_engine_cloud_state_free(&gone);
    return rc;
}

// Of radiance fields and the veil; zero where there are none to copy.
static int copy_moments(TrainState *to, const TrainState *from, const Scene *scene, FsError *err)
{
    const struct {
        float **to, *from;
        size_t n;
    } arrays[] = {
        {&to->field_m, from->field_m, scene->field.n},
        {&to->field_v, from->field_v, scene->field.n},
        {&to->veil_m, from->veil_m, fs_image_values(&scene->veil.light)},
        {&to->veil_v, from->veil_v, fs_image_values(&scene->veil.light)},
    };
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
        size_t n = arrays[k].n;
        if (n && !*arrays[k].to && !(*arrays[k].to = calloc(n, sizeof(float)))) return fs_error_memory(err);
        if (n && arrays[k].from) memcpy(*arrays[k].to, arrays[k].from, n * sizeof(float));
    }
    return 0;
}

static int copy_state(TrainState *to, const TrainState *from, const Scene *scene, FsError *err)
{
    memcpy(to->m, from->m, sizeof to->m);
    memcpy(to->v, from->v, sizeof to->v);
    int rc = copy_moments(to, from, scene, err);
    for (int l = 0; l < LAYERS && rc == 0; l++)
        if (scene->cloud[l].n) rc = make_state(&to->cloud[l], &scene->cloud[l], &from->cloud[l], NULL, err);
    return rc;
}

int fs_host_engine_need_state(HostEngine *e, FsError *err)
{
    int rc = 0;
    for (int l = 0; l < LAYERS && rc == 0; l++)
        if (e->scene.cloud[l].n && !e->state.cloud[l].screen)
            rc = make_state(&e->state.cloud[l], &e->scene.cloud[l], NULL, NULL, err);
    if (rc == 0 && fs_radiance_is(&e->scene.field)) rc = fs_raster_volumes_need_gradients(&e->volumes, err);
    if (rc == 0) rc = copy_moments(&e->state, &(TrainState){0}, &e->scene, err);
    return rc;
}

static int state_up(Engine *base, const TrainState *state, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    return copy_state(&e->state, state, &e->scene, err);
}

static int state_down(Engine *base, TrainState *state, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    int rc = fs_host_engine_need_state(e, err);
    return rc < 0 ? rc : copy_state(state, &e->state, &e->scene, err);
}

static int edit(Engine *base, const CloudEdit *edit, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    CloudState *state = &e->state.cloud[edit->layer];
    Cloud cloud = {0};
    int rc;
    TRY(fs_host_engine_need_state(e, err));
    TRY(fs_cloud_copy(&cloud, edit->cloud, err));
    TRY(make_state(state, &cloud, state, edit, err));
    Cloud gone = e->scene.cloud[edit->layer];
    e->scene.cloud[edit->layer] = cloud;
    cloud = gone;
    if (edit->layer == LAYER_T_N) fs_gain_graph_free(&e->graph);
fail:
    fs_cloud_free(&cloud);
    return rc;
}

static int neighbours(Engine *base, const int *neighbour, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    return fs_gain_graph_make(&e->graph, neighbour, e->scene.cloud[LAYER_T_N].n, err);
}

// ---- photos ----

static void from_image(const Image *image, const Planes *planes, bool encode)
{
    for (int c = 0; c < planes->channels; c++)
        for (int y = 0; y < planes->height; y++) {
            float *row = fs_planes_row(planes, c, y);
            const float *px = image->px + (size_t)y * (size_t)image->width * (size_t)image->channels + c;
            for (int x = 0; x < planes->width; x++)
                row[x] = encode ? fs_tone_encode(px[x * image->channels]) : px[x * image->channels];
        }
}

static int load_view(Engine *base, const EngineView *view, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    int w = view->camera->width, h = view->camera->height;
    size_t three = fs_planes_floats(w, h, 3), bytes = (three + fs_planes_floats(w, h, 1)) * sizeof(float);
    if (fs_memory_grow(&e->views, e->base.n_views, sizeof *e->views, err) < 0) return FS_ERR_MEMORY;
    HostView *v = &e->views[e->base.n_views];
    *v = (HostView){.camera = *view->camera,
                    .flash = view->flash,
                    .state = view->state,
                    .flash_gain = view->flash_gain > 0 ? view->flash_gain : 1,
                    .exposure_gain = view->exposure_gain,
                    .memory = aligned_alloc(64, bytes)};
    if (!v->memory) return fs_error_memory(err);
    memset(v->memory, 0, bytes);
    v->photo = fs_planes_over(v->memory, w, h, 3);
    v->mask = fs_planes_over(v->memory + three, w, h, 1);
    from_image(view->photo, &v->photo, true);
    from_image(view->mask, &v->mask, false);
    if (view->lamps) memcpy(v->lamps, view->lamps, sizeof v->lamps);
    return 0;
}

static int photos_down(Engine *base, PhotoState *states, FsError *err)
{
    (void)err;
    const HostEngine *e = fs_host_engine(base);
    for (int i = 0; i < e->base.n_views; i++) states[i] = e->views[i].state;
    return 0;
}

static int occlusion_up(Engine *base, int view, const OcclusionState *state, FsError *err)
{
    HostView *v = &fs_host_engine(base)->views[view];
    if (!state) {
        free(v->occlusion);
        v->occlusion = NULL;
        return 0;
    }
    if (!v->occlusion && !(v->occlusion = malloc(sizeof *v->occlusion))) return fs_error_memory(err);
    *v->occlusion = *state;
    return 0;
}

static int occlusion_down(Engine *base, int view, OcclusionState *state, FsError *err)
{
    const HostView *v = &fs_host_engine(base)->views[view];
    if (!v->occlusion) return fs_error_set(err, FS_ERR_INPUT, "engine: a photo without occlusion");
    *state = *v->occlusion;
    return 0;
}

// ---- rendering and training begin alike ----

RasterTask *fs_host_engine_task(HostEngine *engine, int task, const PlanPart *part)
{
    RasterTask *t = &engine->task[task];
    t->cloud = part->cloud;
    t->volume = part->volume;
    t->first = part->first;
    t->light = part->lit ? &part->light : NULL;
    t->colors = part->channels;
    t->depth = t->median = t->cover = t->train = t->use_d_transmittance = false;
    return t;
}

#define HOST_DEVICE(name, open)                                                                                        \
    {                                                                                                                  \
        name, open, close_host, scene_up, scene_down, state_up, state_down, edit, neighbours, load_view, photos_down,  \
            occlusion_up, occlusion_down, drop_views, fs_host_render, fs_host_step                                     \
    }
const EngineDevice fs_device_cpu = HOST_DEVICE("cpu", open_cpu);
const EngineDevice fs_device_reference = HOST_DEVICE("reference", open_reference);

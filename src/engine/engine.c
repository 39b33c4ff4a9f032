// Checks what goes to a device, and calls it.
#include "engine/engine.h"

#include <stdlib.h>
#include <string.h>

#include "engine/device.h"

static const EngineDevice *const devices[] = {&fs_device_cpu, &fs_device_reference}; // "auto" takes the first it can
#define N_DEVICES (sizeof devices / sizeof *devices)

int fs_engine_new(Engine **engine, const char *device, const char *cpu, int threads, FsError *err)
{
    *engine = NULL;
    for (size_t i = 0; i < N_DEVICES; i++) {
        if (strcmp(device, "auto") != 0 && strcmp(device, devices[i]->name) != 0) continue;
        int rc = devices[i]->open(engine, cpu, threads, err);
        if (rc == 0) (*engine)->device = devices[i];
        bool next = rc < 0 && rc != FS_ERR_MEMORY && strcmp(device, "auto") == 0 && i + 2 < N_DEVICES;
        if (!next) return rc; // "auto" goes on to what this machine has; never to the reference, which is last
    }
    return fs_error_set(err, FS_ERR_USAGE, "--device: '%s' is not a device of this program", device);
}

void fs_engine_free(Engine *engine)
{
    if (engine) engine->device->close(engine);
}

const char *fs_engine_device(const Engine *engine)
{
    return engine->device->name;
}

// ---- scene ----

static int refuse(FsError *err, const char *what)
{
    return fs_error_set(err, FS_ERR_INPUT, "engine: %s", what);
}

int fs_engine_scene_up(Engine *engine, const Scene *scene, FsError *err)
{
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *c = &scene->cloud[l];
        if (!c->n) continue;
        if ((l == LAYER_T_F && scene->shared_geometry) || (l == LAYER_BETA && scene->pane_beta))
            return refuse(err, "a scene of this kind has no such cloud");
        if (c->width[CLOUD_COLORS] != fs_layers[l].channels)
            return refuse(err, "a cloud has the wrong number of colour channels");
    }
    if (scene->shared_geometry && scene->cloud[LAYER_T_N].n && !scene->cloud[LAYER_T_N].width[CLOUD_GAINS])
        return refuse(err, "shared geometry, but the transmitted cloud has no gains");
    if (fs_pane_veil_is(&scene->veil) && !(fs_scene_lit(scene) && scene->pane_beta))
        return refuse(err, "a veil, which a scene of this kind cannot have");
    engine->up = false;
    int rc = engine->device->scene_up(engine, scene, err);
    if (rc < 0) return rc;
    for (int l = 0; l < LAYERS; l++) {
        engine->n[l] = scene->cloud[l].n;
        memcpy(engine->width[l], scene->cloud[l].width, sizeof engine->width[l]);
    }
    engine->fields = fs_radiance_is(&scene->field);
    engine->veil = fs_pane_veil_is(&scene->veil);
    engine->up = true;
    return 0;
}

int fs_engine_scene_down(Engine *engine, unsigned layers, Scene *scene, FsError *err)
{
    if (!engine->up) return refuse(err, "no scene is up");
    return engine->device->scene_down(engine, layers, scene, err);
}

int fs_engine_state_up(Engine *engine, const TrainState *state, FsError *err)
{
    if (!engine->up) return refuse(err, "no scene is up");
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *moments[2] = {&state->cloud[l].m, &state->cloud[l].v};
        for (int k = 0; k < 2 && engine->n[l]; k++)
            if (moments[k]->n != engine->n[l] ||
                memcmp(moments[k]->width, engine->width[l], sizeof engine->width[l]) != 0)
                return refuse(err, "moments that are not of the scene that is up");
    }
    if (engine->fields != (state->field_m && state->field_v) || engine->veil != (state->veil_m && state->veil_v))
        return refuse(err, "moments that are not of the scene that is up");
    return engine->device->state_up(engine, state, err);
}

int fs_engine_state_down(Engine *engine, TrainState *state, FsError *err)
{
    if (!engine->up) return refuse(err, "no scene is up");
    return engine->device->state_down(engine, state, err);
}

void fs_engine_cloud_state_free(CloudState *state)
{
    fs_cloud_free(&state->m);
    fs_cloud_free(&state->v);
    free(state->screen);
    *state = (CloudState){0};
}

void fs_engine_state_free(TrainState *state)
{
    for (int l = 0; l < LAYERS; l++) fs_engine_cloud_state_free(&state->cloud[l]);
    free(state->field_m);
    free(state->field_v);
    free(state->veil_m);
    free(state->veil_v);
    *state = (TrainState){0};
}

int fs_engine_edit(Engine *engine, const CloudEdit *edit, FsError *err)
{
    int l = edit->layer, n = edit->cloud->n;
    if (!engine->up || !engine->n[l]) return refuse(err, "an edit of a cloud that is not up");
    if (n <= 0 || memcmp(edit->cloud->width, engine->width[l], sizeof engine->width[l]) != 0)
        return refuse(err, "an edit to a cloud of another kind");
    for (int i = 0; i < n; i++)
        if (edit->from[i] < -1 || edit->from[i] >= engine->n[l]) return refuse(err, "an edit from a row that is not");
    int rc = engine->device->edit(engine, edit, err);
    if (rc == 0) engine->n[l] = n;
    return rc;
}

int fs_engine_neighbours(Engine *engine, const int *neighbour, FsError *err)
{
    int n = engine->n[LAYER_T_N];
    if (!engine->up || !engine->width[LAYER_T_N][CLOUD_GAINS]) return refuse(err, "neighbours, but no gains");
    for (int i = 0; i < n * ENGINE_NEIGHBOURS; i++)
        if (neighbour[i] < 0 || neighbour[i] >= n) return refuse(err, "a neighbour that is not");
    return engine->device->neighbours(engine, neighbour, err);
}

// ---- views ----

static bool is_size(const Image *image, const Camera *camera, int channels)
{
    return image->width == camera->width && image->height == camera->height && image->channels == channels;
}

int fs_engine_load_view(Engine *engine, const EngineView *view, FsError *err)
{
    if (!is_size(view->photo, view->camera, 3) || !is_size(view->mask, view->camera, 1))
        return refuse(err, "a photo or mask that is not of its camera's size");
    MUST(engine->device->load_view(engine, view, err));
    engine->n_views++;
    return 0;
}

int fs_engine_photos_down(Engine *engine, PhotoState *states, FsError *err)
{
    return engine->device->photos_down(engine, states, err);
}

int fs_engine_occlusion_up(Engine *engine, int view, const OcclusionState *state, FsError *err)
{
    if (view < 0 || view >= engine->n_views) return refuse(err, "occlusion of a photo that is not loaded");
    return engine->device->occlusion_up(engine, view, state, err);
}

int fs_engine_occlusion_down(Engine *engine, int view, OcclusionState *state, FsError *err)
{
    if (view < 0 || view >= engine->n_views) return refuse(err, "occlusion of a photo that is not loaded");
    return engine->device->occlusion_down(engine, view, state, err);
}

void fs_engine_drop_views(Engine *engine)
{
    engine->device->drop_views(engine);
    engine->n_views = 0;
}

int fs_engine_render(Engine *engine, const Camera *camera, Renders *renders, FsError *err)
{
    if (!engine->up) return refuse(err, "no scene is up");
    return engine->device->render(engine, camera, renders, err);
}

void fs_engine_renders_free(Renders *renders)
{
    for (int l = 0; l < RENDER_LAYERS; l++) fs_image_free(&renders->layer[l]);
}

int fs_engine_step(Engine *engine, const StepArgs *args, StepResult *result, FsError *err)
{
    if (!engine->up) return refuse(err, "no scene is up");
    if (args->view < 0 || args->view >= engine->n_views) return refuse(err, "a step at a photo that is not loaded");
    *result = (StepResult){0};
    return engine->device->step(engine, args, result, err);
}

// A real training step through the engine: transmitted and mirrored cloud, pane and gains, all loss terms of the preset
// `preview`, flash and no-flash photos in turns.
#include <math.h>
#include <stdlib.h>

#include "base/rng.h"
#include "bench/case.h"
#include "engine/made_scene.h"

typedef struct TrainCase {
    Engine *engine;
    StepArgs args;
} TrainCase;

static int load_scene(Engine *engine, int n, Scene *scene)
{
    Rng rng = fs_rng_new(4);
    int rc, *neighbour = malloc(sizeof(int) * ENGINE_NEIGHBOURS * (size_t)n);
    if (!neighbour) return FS_ERR_MEMORY;
    TRY(fs_cloud_new(&scene->cloud[LAYER_T_N], n, 3, 1, NULL));
    TRY(fs_cloud_new(&scene->cloud[LAYER_R], n, 3, 0, NULL));
    fs_made_scene_fill(&scene->cloud[LAYER_T_N], 1.2 / sqrt(n));
    fs_made_scene_fill(&scene->cloud[LAYER_R], 1.2 / sqrt(n));
    for (int i = 0; i < n; i++)
        for (int k = 0; k < ENGINE_NEIGHBOURS; k++)
            neighbour[i * ENGINE_NEIGHBOURS + k] = (i + 1 + fs_rng_below(&rng, n - 1)) % n;
    TRY(fs_engine_scene_up(engine, scene, NULL));
    TRY(fs_engine_neighbours(engine, neighbour, NULL));
fail:
    free(neighbour);
    return rc;
}

// Rates so small that the hundredth call sees the same clouds as the first.
static int make_args(const Scene *scene, StepArgs *args)
{
    FsSettings *set = fs_settings_new();
    if (!set) return FS_ERR_MEMORY;
    *args = (StepArgs){.slope_floor = set->slope_floor};
    fs_loss_weights(set, scene, 1, args->weight);
    for (int f = 0; f < CLOUD_FIELDS; f++) args->rate[f] = 1e-9;
    fs_settings_free(set);
    return 0;
}

void *fs_case_train_open(const BenchMachine *machine, const BenchCase *what)
{
    const Camera camera = fs_made_scene_camera(what->width, what->height);
    Scene scene = fs_made_scene();
    TrainCase *s = calloc(1, sizeof *s);
    int rc = s ? 0 : FS_ERR_MEMORY;
    if (rc == 0)
        rc = fs_engine_new(&s->engine, "cpu", fs_cpu_name(machine->kernels.level), fs_threads_count(machine->threads),
                           NULL);
    if (rc == 0) rc = load_scene(s->engine, what->n, &scene);
    if (rc == 0) rc = fs_made_scene_load(s->engine, &camera, NULL);
    if (rc == 0) rc = make_args(&scene, &s->args);
    fs_scene_free(&scene);
    if (rc == 0) return s;
    if (s) fs_case_train_close(s);
    return NULL;
}

void fs_case_train_close(void *state)
{
    TrainCase *s = state;
    fs_engine_free(s->engine);
    free(s);
}

BenchWork fs_case_train_call(void *state)
{
    TrainCase *s = state;
    StepResult result;
    for (s->args.view = 0; s->args.view < 2; s->args.view++, s->args.step++)
        if (fs_engine_step(s->engine, &s->args, &result, NULL) < 0) abort(); // out of memory amid a measurement
    double splats = 2.0 * (result.visible[LAYER_T_N] + result.visible[LAYER_R]);
    return (BenchWork){.pairs = splats, .splats = splats};
}

// What training will take: steps on made clouds of the sizes that the schedule goes through are timed.
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/rng.h"
#include "train/train.h"
#include "train/train_constants.h"
#include "train/trainer.h"

enum { SAMPLES = 8, MOST_STEPS = 8, REFERENCE_SPLATS = 20000, REFERENCE_EDGE = 300 };
#define ENOUGH_SECONDS 0.15 // of steps at a sample
#define BESIDE_STEPS 1.26   // experiment  what real clouds take longer, and what is done between steps
#define SPLAT_SIZE 2.4 // experiment  of made Gaussians, by the root of their number: steps take as long as real ones

// Bytes, measured on captures of 300 to 2400 pixels.
#define BYTES_PROGRAM 30e6
#define BYTES_VIEW 40.0  // a pixel of a photo: itself, what SSIM needs of it, mask
#define BYTES_STEP 280.0 // a pixel of the view that is rendered
#define BYTES_SPLAT 360.0

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int load_photos(Engine *engine, const Camera *camera, FsError *err)
{
    Image photo = {0}, mask = {0};
    int rc;
    TRY(fs_image_new(&photo, camera->width, camera->height, 3, err));
    TRY(fs_image_new(&mask, camera->width, camera->height, 1, err));
    for (size_t i = 0; i < fs_image_pixels(&mask); i++) mask.px[i] = 1;
    for (size_t i = 0; i < fs_image_values(&photo); i++) photo.px[i] = 0.2f + 0.15f * sinf(0.05f * (float)i);
    for (int flash = 0; flash < 2; flash++)
        TRY(fs_engine_load_view(engine, &(EngineView){camera, flash, &photo, &mask}, err));
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    return rc;
}

static int make_cloud(Cloud *cloud, int n, int gains, FsError *err)
{
    Rng rng = fs_rng_new(3);
    MUST(fs_cloud_new(cloud, n, 3, gains, err));
    for (int i = 0; i < n; i++) {
        float *mean = cloud->field[CLOUD_MEANS] + 3 * i, z = 2 + 4 * fs_rng_uniform(&rng);
        mean[0] = (fs_rng_uniform(&rng) - 0.5f) * z * 1.05f;
        mean[1] = (fs_rng_uniform(&rng) - 0.5f) * z * 0.75f;
        mean[2] = z;
        float size = (float)log(SPLAT_SIZE / sqrt(n)) + 0.5f * fs_rng_normal(&rng);
        for (int k = 0; k < 3; k++) cloud->field[CLOUD_SCALES][3 * i + k] = size + 0.5f * fs_rng_normal(&rng);
        for (int k = 0; k < 4; k++) cloud->field[CLOUD_QUATS][4 * i + k] = fs_rng_normal(&rng);
        cloud->field[CLOUD_OPACITIES][i] = -2.5f + fs_rng_normal(&rng);
        for (int k = 0; k < 3; k++) cloud->field[CLOUD_COLORS][3 * i + k] = fs_rng_uniform(&rng);
    }
    return 0;
}

static int make_scene(Engine *engine, int n, Scene *scene, FsError *err)
{
    int rc, *neighbour = malloc(sizeof(int) * ENGINE_NEIGHBOURS * (size_t)n);
    if (!neighbour) return fs_error_memory(err);
    for (int i = 0; i < n * ENGINE_NEIGHBOURS; i++)
        neighbour[i] = (i / ENGINE_NEIGHBOURS + i % ENGINE_NEIGHBOURS + 1) % n;
    *scene = (Scene){.shared_geometry = true,
                     .pane_beta = true,
                     .pane = {{0.5, 0, -0.866}, 0.1, 0.1},
                     .gain_color = {1.5, 1.4, 1.3},
                     .flash_distance = 3,
                     .extent = 0.5,
                     .flash_return = 0.1};
    TRY(make_cloud(&scene->cloud[LAYER_T_N], n, 1, err));
    TRY(make_cloud(&scene->cloud[LAYER_R], n, 0, err));
    TRY(fs_engine_scene_up(engine, scene, err));
    TRY(fs_engine_neighbours(engine, neighbour, err));
fail:
    free(neighbour);
    return rc;
}

// Seconds of a step, and of a render of all layers (NULL: not wanted), with clouds of n.
static int time_step(const FsProject *project, const RunSize *size, int n, double *step, double *render, FsError *err)
{
    const Settings *set = &project->set;
    int width = size->width, height = size->height;
    Engine *engine = NULL;
    Scene scene = {0};
    Renders renders = {0};
    StepResult result;
    StepArgs args;
    const Camera camera = {
        width, height, width, width, 0.5 * width, 0.5 * height, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    int rc, steps = 0;
    TRY(fs_engine_new(&engine, set->device, set->cpu, set->threads, err));
    TRY(make_scene(engine, n, &scene, err));
    TRY(load_photos(engine, &camera, err));
    fs_schedule_step(set, &scene, set->steps / 2, &args);
    for (int f = 0; f < CLOUD_FIELDS; f++) args.rate[f] = 1e-9; // the clouds stay as they are
    args.explore = 0;
    double begin = 0, total = 0;
    for (steps = -1; steps < MOST_STEPS && (steps < 2 || total < ENOUGH_SECONDS); steps++) { // the first warms up
        if (steps == 0) begin = now();
        args.view = steps & 1;
        TRY(fs_engine_step(engine, &args, &result, err));
        total = steps >= 0 ? now() - begin : 0;
    }
    *step = total / steps;
    begin = now();
    if (render) TRY(fs_engine_render(engine, &camera, &renders, err));
    if (render) *render = now() - begin;
fail:
    fs_engine_renders_free(&renders);
    fs_scene_free(&scene);
    fs_engine_free(engine);
    return rc;
}

int fs_train_reference(const FsProject *project, double *seconds, FsError *err)
{
    return time_step(project, &(RunSize){0, REFERENCE_EDGE, REFERENCE_EDGE * 2 / 3, 0}, REFERENCE_SPLATS, seconds, NULL,
                     err);
}

// The size of a cloud at a step.
static int splats_at(const Settings *set, const RunSize *size, int step)
{
    int n = set->init_count, budget = fs_schedule_budget(set, (double)size->width * size->height);
    for (int s = 1; s <= step && strcmp(set->densify, "none") != 0; s++)
        if (fs_schedule_relocates(set, s)) n = (int)fmax(n, fs_schedule_grown(set, budget, n, s));
    return n;
}

double fs_train_bytes(const Settings *set, const RunSize *size)
{
    double pixels = (double)size->width * size->height;
    return BYTES_PROGRAM + pixels * (BYTES_VIEW * size->photos + BYTES_STEP) +
           2 * BYTES_SPLAT * splats_at(set, size, set->steps);
}

int fs_train_estimate(const FsProject *project, const RunSize *size, RunCost *cost, double *render, FsError *err)
{
    const Settings *set = &project->set;
    *cost = (RunCost){0, fs_train_bytes(set, size)};
    double seconds = 0;
    int long_edge = size->width > size->height ? size->width : size->height, last_n = 0, last_halvings = -1;
    for (int i = 0; i < SAMPLES; i++) {
        int step = (int)((i + 0.5) * set->steps / SAMPLES), n = splats_at(set, size, step);
        int halvings = fs_schedule_halvings(set, long_edge, step);
        RunSize at = {0, size->width >> halvings, size->height >> halvings, 0};
        bool end = i == SAMPLES - 1;
        if (fs_log_cancelled(&project->log)) return fs_error_set(err, FS_ERR_CANCELLED, "cancelled before it started");
        if (n != last_n || halvings != last_halvings || end)
            MUST(time_step(project, &at, n, &seconds, end ? render : NULL, err));
        cost->seconds += BESIDE_STEPS * seconds * set->steps / SAMPLES;
        last_n = n;
        last_halvings = halvings;
    }
    return 0;
}

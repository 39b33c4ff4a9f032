// What training will take: steps on made clouds of the sizes that the schedule goes through are timed.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/order.h"
#include "engine/made_scene.h"
#include "train/train.h"
#include "train/train_constants.h"
#include "train/trainer.h"

enum {
    LEAST_STEPS = 3,
    MOST_STEPS = 9,
    REFERENCE_SPLATS = 6000,
    REFERENCE_EDGE = 150,
    FIELD_EDGE = 300,
    FEWEST_STEPS = 300
};
#define ENOUGH_SECONDS 0.15 // of steps in a trial
#define BESIDE_STEPS 1.5    // experiment  what real clouds take longer, and what is done between steps
#define SPLAT_SIZE 2.4 // experiment  of made Gaussians, by the root of their number: steps take as long as real ones

// Bytes, measured on captures of 300 to 2400 pixels.
#define BYTES_PROGRAM 30e6
#define BYTES_VIEW 16.0   // a pixel of a photo: itself, mask
#define BYTES_STEP 328.0  // a pixel of the view that is rendered
#define BYTES_SHEET 550.0 // a pixel of a view, for contact sheets
#define BYTES_SPLAT 740.0
#define BYTES_NUMBER 16.0 // of a radiance field: itself, its gradient, two moments
#define BYTES_FIELD 10e6
#define BYTES_VOLUME 35e6 // samples of a step

// A step that looks around first, of one with the start's clouds: for the photographer at the coarsest size, which is
// larger than that look's (two more such looks where somebody is found, one over a display case); at the pane at the
// size that it is looked at, with the search for dirt.
#define PHOTOGRAPHER_STEP 0.68
#define PANE_STEP 1.5

static bool is_field(const Settings *set)
{
    return strcmp(set->model, "field") == 0;
}

// Which layers have a cloud of their own.
static bool has_cloud(const Settings *set, Layer layer)
{
    Scene kind = {0};
    if (is_field(set)) return false;
    fs_scene_set_kind(&kind, set);
    switch (layer) {
    case LAYER_T_F: return !kind.shared_geometry;
    case LAYER_R: return kind.separation != SEPARATION_NONE;
    case LAYER_BETA: return !kind.pane_beta;
    default: return true;
    }
}

static RadianceShape field_shape(Separation separation, int long_edge)
{
    return fs_radiance_shape(separation == SEPARATION_FULL, separation != SEPARATION_NONE, long_edge);
}

// As initialise makes them; a step takes as many samples whatever they are like.
static int make_field(Scene *scene, FsError *err)
{
    const RadianceShape shape = field_shape(scene->separation, FIELD_EDGE);
    const RadianceFrame frame = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {-0.6, -0.6}, {0.6, 0.6}, 1, 10, 0.7};
    scene->pane_beta = false;
    return fs_radiance_new(&scene->field, &shape, &frame, 1, err);
}

static int make_scene(Engine *engine, const Settings *set, int n, Scene *scene, FsError *err)
{
    int rc, *neighbour = malloc(sizeof(int) * ENGINE_NEIGHBOURS * (size_t)n);
    if (!neighbour) return fs_error_memory(err);
    for (int i = 0; i < n * ENGINE_NEIGHBOURS; i++)
        neighbour[i] = (i / ENGINE_NEIGHBOURS + i % ENGINE_NEIGHBOURS + 1) % n;
    *scene = fs_made_scene();
    fs_scene_set_kind(scene, set);
    if (is_field(set)) TRY(make_field(scene, err));
    for (int l = 0; l < LAYERS; l++) {
        if (!has_cloud(set, l)) continue;
        bool gains = l == LAYER_T_N && scene->shared_geometry;
        TRY(fs_cloud_new(&scene->cloud[l], n, fs_layers[l].channels, gains, err));
        fs_made_scene_fill(&scene->cloud[l], SPLAT_SIZE / sqrt(n));
    }
    TRY(fs_engine_scene_up(engine, scene, err));
    if (scene->cloud[LAYER_T_N].width[CLOUD_GAINS]) TRY(fs_engine_neighbours(engine, neighbour, err));
fail:
    free(neighbour);
    return rc;
}

// Seconds of a step, and of a render of all layers (NULL: not wanted), with clouds of n.
static int time_step(const FsProject *project, const RunSize *size, int n, const int stride[2], double *step,
                     double *render, FsError *err)
{
    const Settings *set = &project->set;
    Engine *engine = NULL;
    Scene scene = {0};
    Renders renders = {0};
    StepResult result;
    StepArgs args;
    const Camera camera = fs_made_scene_camera(size->width, size->height);
    int rc, steps = 0;
    TRY(fs_engine_new(&engine, set->device, set->cpu, set->threads, err));
    TRY(make_scene(engine, set, n, &scene, err));
    TRY(fs_made_scene_load(engine, &camera, err));
    fs_schedule_step(set, &scene, set->steps / 2, &args);
    for (int f = 0; f < CLOUD_FIELDS; f++) args.rate[f] = 1e-9; // the clouds stay as they are
    args.settle = 0;
    args.learn = fs_schedule_learns(set, false);
    for (int k = 0; k < 2; k++) args.stride[k] = stride[k];
    float took[MOST_STEPS];
    double begin, total = 0;
    for (steps = -1; steps < MOST_STEPS && (steps < LEAST_STEPS || total < ENOUGH_SECONDS); steps++) {
        begin = fs_clock_seconds();
        args.view = steps & 1;
        TRY(fs_engine_step(engine, &args, &result, err));
        if (steps < 0) continue; // it warms up
        took[steps] = (float)(fs_clock_seconds() - begin);
        total += (double)took[steps];
    }
    fs_order_floats(took, (size_t)steps);
    *step = (double)took[steps / 4]; // those that other programs held up do not count
    begin = fs_clock_seconds();
    if (render) TRY(fs_engine_render(engine, &camera, &renders, err));
    if (render) *render = fs_clock_seconds() - begin;
fail:
    fs_engine_renders_free(&renders);
    fs_scene_free(&scene);
    fs_engine_free(engine);
    return rc;
}

int fs_train_reference(const FsProject *project, double *seconds, FsError *err)
{
    FsProject plain = {0};
    FsSettings *set = fs_settings_new();
    if (!set) return fs_error_memory(err);
    int rc;
    TRY(fs_settings_set(set, "cpu", "scalar", err));
    set->threads = project->set.threads;
    plain.set = *set;
    TRY(time_step(&plain, &(RunSize){0, REFERENCE_EDGE, REFERENCE_EDGE * 2 / 3, 0}, REFERENCE_SPLATS,
                  (const int[2]){1, 1}, seconds, NULL, err));
fail:
    fs_settings_free(set);
    return rc;
}

// The size of a cloud after a step.
static int grown(const Settings *set, int budget, int n, int step)
{
    if (strcmp(set->densify, "relocate") == 0 && fs_schedule_relocates(set, step))
        n = (int)fmax(n, fs_schedule_grown(set, budget, n, step));
    if (strcmp(set->densify, "fsgs") == 0 && fs_schedule_fsgs(step)) n = (int)fmax(n, fmin(FSGS_GROWTH * n, budget));
    return n;
}

static int first_splats(const Settings *set, const RunSize *size)
{
    return size->splats ? size->splats : set->init_count;
}

static int last_splats(const Settings *set, const RunSize *size)
{
    int n = first_splats(set, size), budget = fs_schedule_budget(set, (double)size->width * size->height);
    for (int step = 1; step <= set->steps; step++) n = grown(set, budget, n, step);
    return n;
}

static int long_edge(const RunSize *size)
{
    return size->width > size->height ? size->width : size->height;
}

static double field_bytes(const Settings *set, const RunSize *size)
{
    if (!is_field(set)) return 0;
    const RadianceShape shape = field_shape(fs_scene_separation(set->separation), long_edge(size));
    return BYTES_FIELD + BYTES_NUMBER * (double)fs_radiance_floats(&shape) +
           BYTES_VOLUME * (shape.colors[VOLUME_R] ? 2 : 1);
}

// Most pixels that a step looks at.
static double step_pixels(const Settings *set, const RunSize *size)
{
    double pixels = (double)size->width * size->height, most = 0;
    for (int h = fs_schedule_halvings(set, long_edge(size), 0); h >= 0; h--) {
        int stride[2];
        fs_schedule_stride(set, h, pixels, fs_schedule_budget(set, pixels), stride);
        most = fmax(most, ldexp(pixels, -2 * h) / (stride[0] * stride[1]));
    }
    return most;
}

double fs_train_bytes(const Settings *set, const RunSize *size)
{
    double pixels = (double)size->width * size->height;
    int clouds = 0;
    for (int l = 0; l < LAYERS; l++) clouds += has_cloud(set, l);
    return BYTES_PROGRAM + pixels * (BYTES_VIEW * size->photos + (set->progress_every ? BYTES_SHEET : 0)) +
           BYTES_STEP * step_pixels(set, size) + clouds * BYTES_SPLAT * last_splats(set, size) + field_bytes(set, size);
}

RunSize fs_trainer_size(const Trainer *trainer)
{
    RunSize size = {.photos = trainer->n_views};
    for (int i = 0; i < trainer->n_views; i++) {
        const Camera *camera = &trainer->views[i]->camera;
        if ((double)camera->width * camera->height <= (double)size.width * size.height) continue;
        size.width = camera->width;
        size.height = camera->height;
    }
    for (int l = 0; l < LAYERS; l++)
        if (trainer->scene.cloud[l].n > size.splats) size.splats = trainer->scene.cloud[l].n;
    return size;
}

int fs_train_size(FsProject *project, RunSize *size, FsError *err)
{
    int rc;
    Trainer trainer = {.project = project, .set = &project->set};
    TRY(fs_views_load(&trainer, err));
    TRY(fs_scene_read(&trainer.scene, fs_file_at("%s/start", project->out).text, err));
    *size = fs_trainer_size(&trainer);
fail:
    fs_views_free(&trainer);
    fs_scene_free(&trainer.scene);
    return rc;
}

int fs_train_time(const FsProject *project, const RunSize *size, TrainPace *pace, FsError *err)
{
    const Settings *set = &project->set;
    *pace = (TrainPace){.splats = {first_splats(set, size), last_splats(set, size)}};
    double pixels = (double)size->width * size->height;
    for (int h = fs_schedule_halvings(set, long_edge(size), 0); h >= 0; h--) {
        RunSize at = {.width = (int)fmax(1, size->width >> h), .height = (int)fmax(1, size->height >> h)};
        int stride[2];
        fs_schedule_stride(set, h, pixels, fs_schedule_budget(set, pixels), stride);
        for (int k = 0; k < 2; k++) {
            if (fs_log_cancelled(&project->log))
                return fs_error_set(err, FS_ERR_CANCELLED, "cancelled before it started");
            pace->step[h][k] = pace->step[h][0];
            if (k == 0 || h == 0 || pace->splats[1] > pace->splats[0])
                MUST(time_step(project, &at, pace->splats[k], stride, &pace->step[h][k], k && !h ? &pace->render : NULL,
                               err));
        }
    }
    return 0;
}

bool fs_train_cost_mirrors(const Settings *set)
{
    return has_cloud(set, LAYER_R) && strcmp(set->beta, "pane") == 0;
}

double fs_train_seconds(const Settings *set, const RunSize *size, const TrainPace *pace, int steps)
{
    Settings with = *set;
    with.steps = steps;
    int n = pace->splats[0], budget = fs_schedule_budget(set, (double)size->width * size->height);
    int coarsest = fs_schedule_halvings(&with, long_edge(size), 0);
    int pane = fs_pane_look_halvings(long_edge(size));
    double seconds = PHOTOGRAPHER_STEP * fs_photographer_steps(&with, size->photos) * pace->step[coarsest][0] +
                     PANE_STEP * fs_pane_look_steps(&with) * pace->step[pane < coarsest ? pane : coarsest][0];
    double more = fmax(pace->splats[1] - n, 1);
    for (int step = 0; step < steps; step++) {
        const double *at = pace->step[fs_schedule_halvings(&with, long_edge(size), step)];
        seconds += at[0] + (at[1] - at[0]) * (n - pace->splats[0]) / more;
        n = grown(&with, budget, n, step + 1);
    }
    return BESIDE_STEPS * seconds;
}

int fs_train_steps(const Settings *set, const RunSize *size, const TrainPace *pace, double seconds)
{
    int fit = FEWEST_STEPS < set->steps ? FEWEST_STEPS : set->steps, most = set->steps;
    while (fit < most) {
        int steps = (fit + most + 1) / 2;
        if (fs_train_seconds(set, size, pace, steps) <= seconds)
            fit = steps;
        else
            most = steps - 1;
    }
    return fit;
}

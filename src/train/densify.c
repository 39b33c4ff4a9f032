// Where Gaussians are added and taken away.
//
// relocate (after 3DGS as Markov chain Monte Carlo, Kheradmand et al. 2024): dead Gaussians move to live ones, drawn by
// opacity and by how much photos pull at them, and the number grows up to the budget; what shares a place stands in a
// row there, of an opacity and a scale such that the picture stays. On one point, as in the paper, all would be
// pulled alike and stay one. Exact counts, no thresholds on gradients. fsgs: see fsgs.c.
#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "model/camera.h"
#include "train/cloud_edit.h"
#include "train/train_constants.h"
#include "train/trainer.h"

// ---- relocation ----

// The draws of one round.
typedef struct Draws {
    const float *screen; // (n, 2) CloudState.screen; NULL: not known
    unsigned char *dead; // (n)
    int *target, *drawn; // (room) Gaussian number target[d] goes beside drawn[d]
    int *counts;         // (room) times that a Gaussian was drawn; -1 - i once i is the last one of its row
    float *steps;        // (room, 3) from one to the next of a row
    double *sums;        // (n) of opacities
} Draws;

// Growth goes where the picture is still pulled at, by all photos together.
static double weight_of(const Cloud *cloud, const float *screen, int i)
{
    double opacity = (double)fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]);
    return screen ? opacity * ((double)screen[2 * i] + 1e-12) : opacity;
}

// Draws `count` of the first n Gaussians, those alive, by their weights.
static void draw(const Cloud *cloud, int n, int count, Rng *rng, Draws *d)
{
    double total = 0;
    for (int i = 0; i < n; i++) d->sums[i] = total += d->dead[i] ? 0 : weight_of(cloud, d->screen, i);
    for (int k = 0; k < count; k++) {
        double at = ((double)fs_rng_u32(rng) + 0.5) * 0x1p-32 * total;
        int low = 0, high = n - 1;
        while (low < high) {
            int mid = (low + high) / 2;
            if (d->sums[mid] > at)
                high = mid;
            else
                low = mid + 1;
        }
        d->drawn[k] = low;
        d->counts[low]++;
    }
}

// Gaussian i becomes the first of n alike, evenly in a row along its longest axis. Of its variance there SPREAD is now
// that of their places and the rest their own; where they stand, all together have its opacity, on average.
static void begin_row(Cloud *cloud, int i, int n, float step[3])
{
    float *scale = cloud->field[CLOUD_SCALES] + 3 * i, *logit = &cloud->field[CLOUD_OPACITIES][i];
    const float *q = cloud->field[CLOUD_QUATS] + 4 * i;
    const double quat[4] = {q[0], q[1], q[2], q[3]};
    double rotation[9], end = sqrt(3 * SPREAD * (n - 1) / (n + 1)), density = 0; // end: in standard deviations
    for (int k = 0; k < n; k++) {
        double x = end * (2.0 * k / (n - 1) - 1);
        density += exp(-x * x / (2 * (1 - SPREAD))) / n;
    }
    float o = (float)(1 - pow(1 - fmin((double)fs_cloud_edit_sigmoid(*logit), 0.9999), 1.0 / n)) / (float)density;
    *logit = fs_cloud_edit_logit(o < OPACITY_DEAD ? OPACITY_DEAD : o > SOLID ? SOLID : o);
    int axis = scale[0] >= scale[1] && scale[0] >= scale[2] ? 0 : scale[1] >= scale[2] ? 1 : 2;
    double length = exp((double)scale[axis]) * end;
    fs_camera_quat_to_rotation(quat, rotation);
    for (int a = 0; a < 3; a++) {
        step[a] = (float)(2 * length / (n - 1) * rotation[3 * a + axis]);
        cloud->field[CLOUD_MEANS][3 * i + a] -= (float)(length * rotation[3 * a + axis]);
    }
    scale[axis] += (float)(0.5 * log(1 - SPREAD));
}

// Puts the targets beside what was drawn.
static void place(Edit *edit, int count, Draws *d)
{
    float *means = edit->cloud->field[CLOUD_MEANS];
    for (int k = 0; k < count; k++) {
        int from = d->drawn[k], to = d->target[k], last = from;
        float *step = d->steps + 3 * from;
        if (d->counts[from] > 0) {
            begin_row(edit->cloud, from, d->counts[from] + 1, step);
            edit->from[from] = -1;
        } else {
            last = -1 - d->counts[from];
        }
        fs_cloud_edit_copy(edit, to, last);
        for (int a = 0; a < 3; a++) means[3 * to + a] += step[a];
        edit->from[to] = -1;
        d->counts[from] = -1 - to;
    }
}

int fs_densify_relocate(Edit *edit, int grown, const float *screen, Rng *rng, FsError *err)
{
    Cloud *cloud = edit->cloud;
    int n = cloud->n, n_dead = 0;
    size_t room = (size_t)grown + 1;
    Draws d = {.screen = screen,
               .dead = calloc((size_t)n + 1, 1),
               .target = malloc(sizeof(int) * room),
               .drawn = malloc(sizeof(int) * room),
               .counts = calloc(room, sizeof(int)),
               .steps = malloc(sizeof(float) * 3 * room),
               .sums = malloc(sizeof(double) * ((size_t)n + 1))};
    int rc = d.dead && d.target && d.drawn && d.counts && d.steps && d.sums ? 0 : fs_error_memory(err);
    if (rc < 0) goto fail;
    for (int i = 0; i < n; i++)
        if (fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]) <= OPACITY_DEAD) {
            d.dead[i] = 1;
            d.target[n_dead++] = i;
        }
    if (n_dead == n) {
        rc = fs_error_set(err, FS_ERR_NUMERIC, "all its Gaussians are transparent");
        goto fail;
    }
    draw(cloud, n, n_dead, rng, &d);
    place(edit, n_dead, &d);
    memset(d.counts, 0, sizeof(int) * room);
    memset(d.dead, 0, (size_t)n);
    draw(cloud, n, grown - n, rng, &d);
    TRY(fs_cloud_edit_append(edit, grown - n, err));
    for (int i = n; i < grown; i++) d.target[i - n] = i;
    place(edit, grown - n, &d);
fail:
    free(d.dead);
    free(d.target);
    free(d.drawn);
    free(d.counts);
    free(d.steps);
    free(d.sums);
    return rc;
}

// ---- in training ----

int fs_densify_neighbours(Trainer *trainer, FsError *err)
{
    const Cloud *cloud = &trainer->scene.cloud[LAYER_T_N];
    free(trainer->neighbour);
    trainer->neighbour = NULL;
    if (!cloud->width[CLOUD_GAINS] || trainer->set->gain_smooth <= 0 || cloud->n <= ENGINE_NEIGHBOURS) return 0;
    trainer->neighbour = malloc(sizeof(int) * ENGINE_NEIGHBOURS * (size_t)cloud->n);
    if (!trainer->neighbour) return fs_error_memory(err);
    int rc = fs_knn(cloud->field[CLOUD_MEANS], cloud->n, ENGINE_NEIGHBOURS, trainer->neighbour, NULL, trainer->threads);
    if (rc < 0) return fs_error_set(err, rc, "training: a Gaussian's position is not finite, or memory is out");
    return fs_engine_neighbours(trainer->engine, trainer->neighbour, err);
}

// One way to change a cloud; `statistics` as the engine kept them, for fsgs.
typedef int EditCloud(Trainer *trainer, Edit *edit, const CloudState *statistics, Rng *rng, FsError *err);

static int edit_relocate(Trainer *trainer, Edit *edit, const CloudState *statistics, Rng *rng, FsError *err)
{
    int grown = fs_schedule_grown(trainer->set, trainer->budget, edit->cloud->n, trainer->step);
    return fs_densify_relocate(edit, grown, statistics->screen, rng, err);
}

static int edit_fsgs(Trainer *trainer, Edit *edit, const CloudState *statistics, Rng *rng, FsError *err)
{
    int n = edit->cloud->n;
    float *screen = calloc((size_t)n + 1, sizeof *screen);
    if (!screen) return fs_error_memory(err);
    for (int i = 0; i < n; i++)
        if (statistics->screen[2 * i + 1] > 0) screen[i] = statistics->screen[2 * i] / statistics->screen[2 * i + 1];
    FsgsArgs args = {screen, trainer->scene.extent, trainer->budget, trainer->step, trainer->threads};
    int rc = fs_fsgs_densify(edit, &args, rng, err);
    free(screen);
    return rc;
}

static int edit_layer(Trainer *trainer, int layer, EditCloud *change, FsError *err)
{
    Rng rng = fs_rng_new(((uint64_t)trainer->set->seed << 32) + (uint64_t)trainer->step * LAYERS + (uint64_t)layer);
    Edit edit = {0};
    FsError inner = {0};
    int rc;
    TRY(fs_cloud_edit_begin(&edit, &trainer->scene.cloud[layer], err));
    rc = change(trainer, &edit, &trainer->state.cloud[layer], &rng, &inner);
    if (rc == FS_ERR_NUMERIC && layer != LAYER_T_F && layer != LAYER_T_N) rc = 0; // there may be nothing mirrored
    if (rc < 0) {
        fs_error_set(err, rc,
                     "training: layer %s at step %d: %s; the last checkpoint is kept; check poses and flash "
                     "photos",
                     fs_layers[layer].name, trainer->step, inner.message);
        goto fail;
    }
    TRY(fs_engine_edit(trainer->engine, &(CloudEdit){layer, edit.cloud, edit.from, edit.forget}, err));
fail:
    fs_cloud_edit_free(&edit);
    return rc;
}

int fs_densify_step(Trainer *trainer, FsError *err)
{
    if (fs_radiance_is(&trainer->scene.field)) return 0;
    bool fsgs = strcmp(trainer->set->densify, "fsgs") == 0, relocate = strcmp(trainer->set->densify, "relocate") == 0;
    if (!(fsgs ? fs_schedule_fsgs(trainer->step) : relocate && fs_schedule_relocates(trainer->set, trainer->step)))
        return 0;
    int rc;
    TRY(fs_engine_scene_down(trainer->engine, (1u << LAYERS) - 1, &trainer->scene, err));
    TRY(fs_engine_state_down(trainer->engine, &trainer->state, err));
    if (relocate) TRY(fs_curtains_open(trainer, err));
    for (int l = 0; l < LAYERS; l++)
        if (trainer->scene.cloud[l].n) TRY(edit_layer(trainer, l, fsgs ? edit_fsgs : edit_relocate, err));
    TRY(fs_densify_neighbours(trainer, err));
fail:
    return rc;
}

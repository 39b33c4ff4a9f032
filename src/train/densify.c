// Where Gaussians are added and taken away.
//
// relocate (3DGS as Markov chain Monte Carlo, Kheradmand et al. 2024): dead Gaussians move onto live ones, drawn by
// opacity and by how much photos pull at them, and the number grows up to the budget; opacity and scale of what lands
// on one place are changed so that the picture stays (eq. 9). Exact counts, no thresholds on gradients. fsgs: see
// fsgs.c.
#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "train/cloud_edit.h"
#include "train/train_constants.h"
#include "train/trainer.h"

// ---- relocation ----

// Opacity and scale factor of each of n Gaussians that replace one of opacity o (3DGS-MCMC, eq. 9).
static void shared_out(float o, int n, float *opacity, float *shrink)
{
    if (o > 0.9999f) o = 0.9999f;
    double new_o = 1 - pow(1 - (double)o, 1.0 / n), sum = 0;
    for (int i = 1; i <= n; i++) {
        double binomial = 1, power = new_o, sign = 1;
        for (int k = 0; k < i; k++) {
            sum += binomial * sign * power / sqrt(k + 1.0);
            binomial = binomial * (i - 1 - k) / (k + 1);
            power *= new_o;
            sign = -sign;
        }
    }
    *opacity = (float)new_o;
    *shrink = (float)((double)o / sum);
}

// The draws of one round.
typedef struct Draws {
    const float *screen; // (n, 2) CloudState.screen; NULL: not known
    unsigned char *dead; // (n)
    int *target, *drawn; // (room) Gaussian number target[d] goes onto drawn[d]
    int *counts;         // (room) times that a Gaussian was drawn
    double *sums;        // (n) of opacities
} Draws;

// Growth goes where the picture is still pulled at, by all photos together.
static double weight_of(const Cloud *cloud, const float *screen, int i)
{
    double opacity = (double)fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]);
    return screen ? opacity * ((double)screen[2 * i] + 1e-12) : opacity;
}

// Draws `count` of the first n Gaussians, those alive, by opacity.
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

// Puts the targets onto what was drawn and shares opacity and scale out.
static void place(Edit *edit, int count, Draws *d)
{
    Cloud *cloud = edit->cloud;
    for (int k = 0; k < count; k++) {
        int from = d->drawn[k];
        if (d->counts[from] > 0) { // first time: change the source itself
            int copies = d->counts[from] + 1;
            float o, shrink;
            shared_out(fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][from]),
                       copies < MOST_COPIES ? copies : MOST_COPIES, &o, &shrink);
            cloud->field[CLOUD_OPACITIES][from] = fs_cloud_edit_logit(o < DEAD ? DEAD : o);
            for (int a = 0; a < 3; a++) cloud->field[CLOUD_SCALES][3 * from + a] += logf(shrink);
            edit->from[from] = -1;
            d->counts[from] = -1; // done
        }
        fs_cloud_edit_copy(edit, d->target[k], from);
        edit->from[d->target[k]] = -1;
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
               .sums = malloc(sizeof(double) * ((size_t)n + 1))};
    int rc = d.dead && d.target && d.drawn && d.counts && d.sums ? 0 : fs_error_memory(err);
    if (rc < 0) goto fail;
    for (int i = 0; i < n; i++)
        if (fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]) <= DEAD) {
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
    for (int l = 0; l < LAYERS; l++)
        if (trainer->scene.cloud[l].n) TRY(edit_layer(trainer, l, fsgs ? edit_fsgs : edit_relocate, err));
    TRY(fs_densify_neighbours(trainer, err));
fail:
    return rc;
}

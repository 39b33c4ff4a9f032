// Where Gaussians are added and taken away.
//
// relocate (3DGS as Markov chain Monte Carlo, Kheradmand et al. 2024): dead Gaussians move onto live ones, drawn by
// opacity, and the number grows by a fixed share up to the budget; opacity and scale of what lands on one place are
// changed so that the picture stays (eq. 9). Exact counts, no thresholds on gradients.
// fsgs: see fsgs.c.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "train/trainer.h"

#define DEAD 0.005f
#define MOST_COPIES 51
#define EVERY 100
#define GROWTH 1.05

static float sigmoid(float x)
{
    return 1 / (1 + expf(-x));
}
static float logit(float p)
{
    return logf(p / (1 - p));
}

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

static void copy_gaussian(Cloud *cloud, int to, int from)
{
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f];
        if (w) memcpy(cloud->field[f] + (size_t)to * w, cloud->field[f] + (size_t)from * w, sizeof(float) * w);
    }
}

static void zero_gaussian(Cloud *cloud, int i)
{
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f];
        if (w) memset(cloud->field[f] + (size_t)i * w, 0, sizeof(float) * w);
    }
}

// Draws `n` live Gaussians by opacity; counts[i] rises by the times that i was drawn. drawn (n).
static void draw(const Cloud *cloud, int live_below, const unsigned char *dead, int n, Rng *rng, int *drawn,
                 int *counts, double *sums)
{
    double total = 0;
    for (int i = 0; i < live_below; i++)
        sums[i] = total += dead[i] ? 0 : (double)sigmoid(cloud->field[CLOUD_OPACITIES][i]);
    for (int d = 0; d < n; d++) {
        double at = ((double)fs_rng_u32(rng) + 0.5) * 0x1p-32 * total;
        int low = 0, high = live_below - 1;
        while (low < high) {
            int mid = (low + high) / 2;
            if (sums[mid] > at)
                high = mid;
            else
                low = mid + 1;
        }
        drawn[d] = low;
        counts[low]++;
    }
}

// Puts Gaussians number target[d] onto drawn[d] and shares opacity and scale out.
static void place(Cloud *cloud, CloudState *state, const int *target, const int *drawn, int n, int *counts)
{
    for (int d = 0; d < n; d++) {
        int from = drawn[d];
        if (counts[from] > 0) { // first time: change the source itself
            int copies = counts[from] + 1;
            float o, shrink;
            shared_out(sigmoid(cloud->field[CLOUD_OPACITIES][from]), copies < MOST_COPIES ? copies : MOST_COPIES, &o,
                       &shrink);
            cloud->field[CLOUD_OPACITIES][from] = logit(o < DEAD ? DEAD : o);
            for (int k = 0; k < 3; k++) cloud->field[CLOUD_SCALES][3 * from + k] += logf(shrink);
            zero_gaussian(&state->m, from);
            zero_gaussian(&state->v, from);
            counts[from] = -1; // done
        }
        copy_gaussian(cloud, target[d], from);
        zero_gaussian(&state->m, target[d]);
        zero_gaussian(&state->v, target[d]);
    }
}

static int relocate_cloud(Trainer *trainer, int layer, FsError *err)
{
    Cloud *cloud = &trainer->scene.cloud[layer];
    CloudState *state = &trainer->state[layer];
    int n = cloud->n,
        grown = (int)(GROWTH * n) < trainer->set->max_splats ? (int)(GROWTH * n) : trainer->set->max_splats;
    if (grown < n) grown = n;
    Rng rng = fs_rng_new(((uint64_t)trainer->set->seed << 32) + (uint64_t)trainer->step * LAYERS + (uint64_t)layer);
    unsigned char *dead = calloc((size_t)n, 1);
    int *target = malloc(sizeof(int) * (size_t)grown), *drawn = malloc(sizeof(int) * (size_t)grown);
    int *counts = calloc((size_t)grown, sizeof(int));
    double *sums = malloc(sizeof(double) * (size_t)n);
    int rc = dead && target && drawn && counts && sums ? 0 : fs_error_memory(err), n_dead = 0;
    if (rc < 0) goto fail;
    for (int i = 0; i < n; i++)
        if (sigmoid(cloud->field[CLOUD_OPACITIES][i]) <= DEAD) {
            dead[i] = 1;
            target[n_dead++] = i;
        }
    if (n_dead == n) {
        rc = fs_error_set(err, FS_ERR_NUMERIC,
                          "training: layer %s lost all its Gaussians at step %d; the last checkpoint "
                          "is kept; check poses and flash photos",
                          fs_layers[layer].name, trainer->step);
        goto fail;
    }
    draw(cloud, n, dead, n_dead, &rng, drawn, counts, sums);
    place(cloud, state, target, drawn, n_dead, counts);
    memset(counts, 0, sizeof(int) * (size_t)grown);
    memset(dead, 0, (size_t)n);
    draw(cloud, n, dead, grown - n, &rng, drawn, counts, sums);
    TRY(fs_cloud_resize(cloud, grown, err));
    TRY(fs_cloud_resize(&state->m, grown, err));
    TRY(fs_cloud_resize(&state->v, grown, err));
    for (int i = n; i < grown; i++) target[i - n] = i;
    place(cloud, state, target, drawn, grown - n, counts);
fail:
    free(dead);
    free(target);
    free(drawn);
    free(counts);
    free(sums);
    return rc;
}

int fs_densify_step(Trainer *trainer, FsError *err)
{
    const Settings *set = trainer->set;
    if (strcmp(set->densify, "none") == 0) return 0;
    if (strcmp(set->densify, "fsgs") == 0) return fs_fsgs_step(trainer, err);
    int from = set->steps / 20 < 500 ? set->steps / 20 : 500, until = (int)(0.85 * set->steps);
    if (trainer->step < from || trainer->step > until || trainer->step % EVERY) return 0;
    int rc = 0;
    for (int l = 0; l < LAYERS && rc == 0; l++)
        if (trainer->scene.cloud[l].n) rc = relocate_cloud(trainer, l, err);
    if (rc == 0) rc = fs_gains_find_neighbours(trainer, err);
    return rc;
}

// Densification of the paper's code: 3DGS's clone and split where the screen-space gradient is large, pruning of the
// transparent, "proximity unpooling" of FSGS (Zhu et al. 2024) while few, opacity reset.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "base/rng.h"
#include "train/trainer.h"

#define FROM 500
#define UNTIL 10000
#define EVERY 100
#define GRADIENT 5e-4f      // mean screen-space gradient, NDC units
#define PERCENT_DENSE 0.01f // of the extent: larger ones split, smaller ones are cloned
#define OPACITY_MIN 0.005f
#define RESET_EVERY 3000
#define RESET_FROM 2000
#define RESET_OPACITY 0.05f
#define UNPOOL_UNTIL 2000
#define UNPOOL_NEIGHBOURS 3

static float sigmoid(float x)
{
    return 1 / (1 + expf(-x));
}
static float logit(float p)
{
    return logf(p / (1 - p));
}

static float largest_scale(const Cloud *cloud, int i)
{
    const float *s = cloud->field[CLOUD_SCALES] + 3 * i;
    return expf(fmaxf(s[0], fmaxf(s[1], s[2])));
}

static int resize_all(Cloud *cloud, CloudState *state, int n, FsError *err)
{
    int rc = fs_cloud_resize(cloud, n, err);
    if (rc == 0) rc = fs_cloud_resize(&state->m, n, err);
    if (rc == 0) rc = fs_cloud_resize(&state->v, n, err);
    return rc;
}

static void copy_gaussian(Cloud *cloud, int to, int from)
{
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f];
        if (w) memcpy(cloud->field[f] + (size_t)to * w, cloud->field[f] + (size_t)from * w, sizeof(float) * w);
    }
}

// Two samples inside the Gaussian, a factor 1.6 smaller; one takes its place, the other is new.
static void split(Cloud *cloud, int i, int fresh, Rng *rng)
{
    copy_gaussian(cloud, fresh, i);
    const float *q = cloud->field[CLOUD_QUATS] + 4 * i;
    double quat[4] = {q[0], q[1], q[2], q[3]}, r[9];
    fs_camera_quat_to_rotation(quat, r);
    float centre[3], scale[3];
    for (int k = 0; k < 3; k++) {
        centre[k] = cloud->field[CLOUD_MEANS][3 * i + k];
        scale[k] = cloud->field[CLOUD_SCALES][3 * i + k];
    }
    int target[2] = {i, fresh};
    for (int t = 0; t < 2; t++) {
        float local[3];
        for (int k = 0; k < 3; k++) local[k] = expf(scale[k]) * fs_rng_normal(rng);
        for (int k = 0; k < 3; k++) {
            cloud->field[CLOUD_MEANS][3 * target[t] + k] = centre[k] + (float)r[3 * k] * local[0] +
                                                           (float)r[3 * k + 1] * local[1] +
                                                           (float)r[3 * k + 2] * local[2];
            cloud->field[CLOUD_SCALES][3 * target[t] + k] = scale[k] - logf(1.6f);
        }
    }
}

static int clone_and_split(Trainer *trainer, int layer, FsError *err)
{
    Cloud *cloud = &trainer->scene.cloud[layer];
    CloudState *state = &trainer->state[layer];
    int n = cloud->n, room = trainer->set->max_splats - n, rc = 0;
    Rng rng = fs_rng_new(((uint64_t)trainer->set->seed << 32) + (uint64_t)trainer->step * LAYERS + (uint64_t)layer);
    for (int i = 0; i < n && i < state->stats_capacity && room > 0 && rc == 0; i++) {
        if (!state->screen_count[i] || state->screen_sum[i] / (float)state->screen_count[i] < GRADIENT) continue;
        rc = resize_all(cloud, state, cloud->n + 1, err);
        if (rc < 0) break;
        room--;
        if (largest_scale(cloud, i) <= PERCENT_DENSE * (float)trainer->scene.extent)
            copy_gaussian(cloud, cloud->n - 1, i);
        else
            split(cloud, i, cloud->n - 1, &rng);
    }
    return rc;
}

// New Gaussians halfway to the nearest neighbours where these are far and the Gaussian large.
static int unpool(Trainer *trainer, int layer, FsError *err)
{
    Cloud *cloud = &trainer->scene.cloud[layer];
    CloudState *state = &trainer->state[layer];
    int n = cloud->n, rc = 0, room = trainer->set->max_splats - n;
    if (n <= UNPOOL_NEIGHBOURS) return 0;
    int *index = malloc(sizeof(int) * UNPOOL_NEIGHBOURS * (size_t)n);
    float *dist2 = malloc(sizeof(float) * UNPOOL_NEIGHBOURS * (size_t)n);
    if (!index || !dist2) TRY(fs_error_memory(err));
    TRY(fs_knn(cloud->field[CLOUD_MEANS], n, UNPOOL_NEIGHBOURS, index, dist2, trainer->engine->threads));
    float size_min = PERCENT_DENSE * (float)trainer->scene.extent;
    for (int i = 0; i < n && room >= UNPOOL_NEIGHBOURS; i++) {
        float mean = 0;
        for (int k = 0; k < UNPOOL_NEIGHBOURS; k++) mean += sqrtf(dist2[i * UNPOOL_NEIGHBOURS + k]) / UNPOOL_NEIGHBOURS;
        if (mean < 5 * size_min || largest_scale(cloud, i) < size_min) continue;
        for (int k = 0; k < UNPOOL_NEIGHBOURS; k++, room--) {
            int j = index[i * UNPOOL_NEIGHBOURS + k], fresh = cloud->n;
            TRY(resize_all(cloud, state, fresh + 1, err));
            copy_gaussian(cloud, fresh, j);
            for (int a = 0; a < 3; a++)
                cloud->field[CLOUD_MEANS][3 * fresh + a] =
                    0.5f * (cloud->field[CLOUD_MEANS][3 * i + a] + cloud->field[CLOUD_MEANS][3 * j + a]);
        }
    }
fail:
    free(index);
    free(dist2);
    return rc;
}

static int prune(Trainer *trainer, int layer, FsError *err)
{
    Cloud *cloud = &trainer->scene.cloud[layer];
    CloudState *state = &trainer->state[layer];
    if (cloud->n <= 0) return 0;
    unsigned char *keep = calloc((size_t)cloud->n, 1);
    if (!keep) return fs_error_memory(err);
    int kept = 0;
    for (int i = 0; i < cloud->n; i++) kept += keep[i] = sigmoid(cloud->field[CLOUD_OPACITIES][i]) >= OPACITY_MIN;
    int rc = 0;
    if (kept == 0)
        rc = fs_error_set(err, FS_ERR_NUMERIC,
                          "training: layer %s lost all its Gaussians at step %d; the last checkpoint is "
                          "kept; check poses and flash photos",
                          fs_layers[layer].name, trainer->step);
    else {
        fs_cloud_compact(cloud, keep);
        fs_cloud_compact(&state->m, keep);
        fs_cloud_compact(&state->v, keep);
    }
    free(keep);
    return rc;
}

static void reset_opacity(Cloud *cloud, CloudState *state)
{
    float most = logit(RESET_OPACITY);
    for (int i = 0; i < cloud->n; i++) {
        if (cloud->field[CLOUD_OPACITIES][i] > most) cloud->field[CLOUD_OPACITIES][i] = most;
        state->m.field[CLOUD_OPACITIES][i] = state->v.field[CLOUD_OPACITIES][i] = 0;
    }
}

static int collect(Trainer *trainer, int layer, FsError *err)
{
    CloudState *state = &trainer->state[layer];
    int n = trainer->scene.cloud[layer].n;
    if (state->stats_capacity != n) {
        free(state->screen_sum);
        free(state->screen_count);
        state->screen_sum = calloc((size_t)n + 1, sizeof(float));
        state->screen_count = calloc((size_t)n + 1, sizeof(int));
        if (!state->screen_sum || !state->screen_count) return fs_error_memory(err);
        state->stats_capacity = n;
    }
    const RasterTask *task = &trainer->engine->task[layer];
    for (int i = 0; i < n; i++)
        if (task->seen[i]) {
            state->screen_sum[i] += task->d_screen[i];
            state->screen_count[i]++;
        }
    return 0;
}

int fs_fsgs_step(Trainer *trainer, FsError *err)
{
    int rc = 0;
    LayerLight other = trainer->last_flash ? LIT_BY_AMBIENT : LIT_BY_FLASH;
    for (int l = 0; l < LAYERS && rc == 0; l++)
        if (trainer->scene.cloud[l].n && (trainer->scene.shared_geometry || fs_layers[l].light != other))
            rc = collect(trainer, l, err);
    if (rc < 0 || trainer->step < FROM || trainer->step > UNTIL || trainer->step % EVERY) return rc;
    for (int l = 0; l < LAYERS && rc == 0; l++) {
        if (!trainer->scene.cloud[l].n) continue;
        rc = clone_and_split(trainer, l, err);
        if (rc == 0 && trainer->step < UNPOOL_UNTIL) rc = unpool(trainer, l, err);
        if (rc == 0) rc = prune(trainer, l, err);
        trainer->state[l].stats_capacity = 0; // counts begin anew
    }
    for (int l = 0; l < LAYERS && rc == 0; l++)
        if (trainer->step >= RESET_FROM && trainer->step % RESET_EVERY == 0)
            reset_opacity(&trainer->scene.cloud[l], &trainer->state[l]);
    return rc == 0 ? fs_gains_find_neighbours(trainer, err) : rc;
}

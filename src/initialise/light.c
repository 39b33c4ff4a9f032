#include "initialise/light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/knn.h"
#include "base/linalg.h"
#include "base/order.h"
#include "initialise/constants.h"

// Mean over the flash photos of the distance from a point; of (light->distance / distance)^2 where there is a light.
static double mean_over_flash(const SmallViews *views, const float xyz[3], const FlashLight *light)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < views->n; i++) {
        if (!views->view[i].flash && views->n_flash) continue;
        double d2 = v3_distance2((double[3]){xyz[0], xyz[1], xyz[2]}, views->view[i].centre);
        sum += light ? light->distance * light->distance / fmax(d2, 1e-12) : sqrt(d2);
        n++;
    }
    return n ? sum / n : 1;
}

double fs_light_falloff(const SmallViews *views, const FlashLight *light, const float xyz[3])
{
    return mean_over_flash(views, xyz, light);
}

static bool clear_cue(const Cue *cue, unsigned char kind)
{
    return kind == POINT_TRANSMITTED && cue->ok && cue->sigma < LIGHT_SIGMA_MOST;
}

int fs_light_fit(const SmallViews *views, const SparsePoints *points, FlashLight *light, FsError *err)
{
    int n = points->n;
    const float *xyz = points->xyz;
    const Cue *cue = points->cue;
    const unsigned char *kind = points->kind;
    double *value = malloc(sizeof *value * ((size_t)n + 1));
    int m = 0;
    if (!value) return fs_error_memory(err);
    *light = (FlashLight){{1, 1, 1}, 1};
    for (int i = 0; i < n; i++)
        if (kind[i] == POINT_TRANSMITTED) value[m++] = mean_over_flash(views, xyz + 3 * (size_t)i, NULL);
    for (int i = 0; i < n && !m; i++) value[i] = mean_over_flash(views, xyz + 3 * (size_t)i, NULL);
    if (!m) m = n; // nothing is surely transmitted: as far as what there is
    if (m) light->distance = fmax(fs_order_median(value, (size_t)m), 1e-9);
    for (int c = 0; c < 3; c++) {
        m = 0;
        for (int i = 0; i < n; i++)
            if (clear_cue(&cue[i], kind[i]) && cue[i].slope[c] > 0)
                value[m++] = ((double)cue[i].slope[c] - 1) / fs_light_falloff(views, light, xyz + 3 * (size_t)i);
        if (m >= LIGHT_ENOUGH)
            light->color[c] = fmin(fmax(fs_order_median(value, (size_t)m), LIGHT_ALPHA_MIN), LIGHT_ALPHA_MAX);
    }
    free(value);
    return 0;
}

typedef struct GainWork {
    const KnnTree *tree;
    const float *log_gain, *weight; // of the tree's points
    const Seeds *seeds;
    float *gain;
} GainWork;

static void gain_job(void *context, int i, int worker)
{
    (void)worker;
    const GainWork *w = context;
    int index[LIGHT_NEIGHBOURS];
    float dist2[LIGHT_NEIGHBOURS], sum = 0, weight = 0;
    fs_knn_query(w->tree, w->seeds->xyz + 3 * (size_t)i, -1, LIGHT_NEIGHBOURS, index, dist2);
    float soft = isfinite(dist2[LIGHT_NEIGHBOURS / 2]) ? dist2[LIGHT_NEIGHBOURS / 2] : dist2[0];
    for (int k = 0; k < LIGHT_NEIGHBOURS && index[k] >= 0; k++) {
        float wk = w->weight[index[k]] / (dist2[k] + soft + 1e-20f);
        sum += wk * w->log_gain[index[k]];
        weight += wk;
    }
    w->gain[i] = weight > 0 ? fminf(fmaxf(sum / weight, -LIGHT_GAIN_MAX), LIGHT_GAIN_MAX) : 0;
}

int fs_light_gains(const SmallViews *views, const FlashLight *light, const SparsePoints *points, const Seeds *seeds,
                   float *gain, Threads *threads, FsError *err)
{
    int rc = 0, m = 0;
    size_t size = (size_t)points->n + 1;
    Arena arena = {0};
    float *place = ARENA_NEW(&arena, float, 3 * size), *log_gain = ARENA_NEW(&arena, float, size);
    float *weight = ARENA_NEW(&arena, float, size);
    KnnTree *tree = NULL;
    memset(gain, 0, sizeof(float) * (size_t)seeds->n);
    if (arena.failed) TRY(fs_error_memory(err));
    double mean_color = (light->color[0] + light->color[1] + light->color[2]) / 3;
    for (int i = 0; i < points->n; i++) {
        if (!clear_cue(&points->cue[i], points->kind[i])) continue;
        double slope = exp((double)points->cue[i].log_slope), alpha = fmax(slope - 1, LIGHT_ALPHA_MIN);
        double sigma = (double)points->cue[i].sigma * slope / alpha; // of log alpha
        memcpy(place + 3 * (size_t)m, points->xyz + 3 * (size_t)i, sizeof(float) * 3);
        log_gain[m] = (float)log(alpha / mean_color / fs_light_falloff(views, light, points->xyz + 3 * (size_t)i));
        log_gain[m] = fminf(fmaxf(log_gain[m], -2 * LIGHT_GAIN_MAX), 2 * LIGHT_GAIN_MAX);
        weight[m++] = (float)(1 / (sigma * sigma + LIGHT_VARIANCE));
    }
    if (m == 0) goto fail; // gains stay 0
    tree = fs_knn_new(place, m);
    if (!tree) TRY(fs_error_memory(err));
    GainWork work = {tree, log_gain, weight, seeds, gain};
    fs_threads_for(threads, seeds->n, gain_job, &work);
fail:
    fs_knn_free(tree);
    fs_arena_free(&arena);
    return rc;
}

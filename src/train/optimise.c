// Adam over the clouds' fields, with the learning rates of 3DGS, and the small regularisers that act on parameters.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "train/trainer.h"

#define CHUNK 2048
#define GAIN_MIN -3.0f
#define GAIN_MAX 5.0f // in deep shade the flash gives a hundred times the light that was there

static const struct {
    double rate; // per step; means: times the scene's extent, falling to a hundredth
} rates[CLOUD_FIELDS] = {
    [CLOUD_MEANS] = {0}, // the setting means-rate
    [CLOUD_SCALES] = {5e-3},   [CLOUD_QUATS] = {1e-3}, [CLOUD_OPACITIES] = {5e-2},
    [CLOUD_COLORS] = {2.5e-3}, [CLOUD_GAINS] = {5e-3},
};

int fs_optimise_init(Trainer *trainer, FsError *err)
{
    int rc = 0;
    for (int l = 0; l < LAYERS && rc == 0; l++) {
        const Cloud *c = &trainer->scene.cloud[l];
        if (!c->n) continue;
        CloudState *s = &trainer->state[l];
        rc = fs_cloud_new(&s->m, c->n, c->width[CLOUD_COLORS], c->width[CLOUD_GAINS], err);
        if (rc == 0) rc = fs_cloud_new(&s->v, c->n, c->width[CLOUD_COLORS], c->width[CLOUD_GAINS], err);
    }
    return rc;
}

void fs_optimise_free(Trainer *trainer)
{
    for (int l = 0; l < LAYERS; l++) {
        CloudState *s = &trainer->state[l];
        fs_cloud_free(&s->m);
        fs_cloud_free(&s->v);
        free(s->screen_sum);
        free(s->screen_count);
        free(s->neighbour);
        *s = (CloudState){0};
    }
}

// Falls exponentially to a hundredth over the run (the paper's schedule: over 10000 steps).
double fs_optimise_means_rate(const Trainer *trainer)
{
    int over = strcmp(trainer->set->densify, "fsgs") == 0 ? 10000 : trainer->set->steps;
    double t = (double)trainer->step / over;
    return trainer->set->means_rate * trainer->scene.extent * pow(0.01, t < 1 ? t : 1);
}

typedef struct Update {
    Trainer *trainer;
    int first[LAYERS + 1];     // first job of each layer
    double means_rate, settle; // settle: factor on all other rates
    bool lit;                  // the transmitted cloud is stepped as (T_F, gain)
    ShadeLight light;          // of a flash amid the cameras
} Update;

static ShadeLight middle_light(const Trainer *t)
{
    ShadeLight light = {.flash_distance = (float)t->scene.flash_distance};
    double sum[3] = {0}, centre[3];
    for (int i = 0; i < t->n_views; i++) {
        fs_camera_centre(&t->views[i].view->camera, centre);
        for (int k = 0; k < 3; k++) sum[k] += centre[k];
    }
    for (int k = 0; k < 3; k++) {
        light.centre[k] = (float)(sum[k] / t->n_views);
        light.tint[k] = (float)t->scene.gain_color[k];
    }
    return light;
}

// Weight of mean opacity and mean scale (3DGS-MCMC, Kheradmand et al. 2024, eq. 8), added to the gradients; and of
// gains below the usual one, of which there are few: what the flash hardly brightens is mirrored, unless the photos
// insist.
static void regularise(const Trainer *t, const Cloud *cloud, RasterTask *task, int begin, int end)
{
    float w_opacity = (float)(t->set->opacity_reg / cloud->n), w_scale = (float)(t->set->scale_reg / (3.0 * cloud->n));
    w_scale /= (float)t->scene.extent;
    const RegulariseKernels *k = t->engine->kernels.regularise; // those not seen too: Adam passes them over
    size_t n = (size_t)(end - begin);
    k->sigmoid(cloud->field[CLOUD_OPACITIES] + begin, n, w_opacity, task->d_field[CLOUD_OPACITIES] + begin);
    k->exp(cloud->field[CLOUD_SCALES] + 3 * begin, 3 * n, w_scale, task->d_field[CLOUD_SCALES] + 3 * begin);
    if (cloud->width[CLOUD_GAINS] && t->scene.separation == SEPARATION_FULL) {
        float push = (float)(t->set->gain_push / cloud->n);
        for (int i = begin; i < end; i++)
            if (cloud->field[CLOUD_GAINS][i] < 0) task->d_field[CLOUD_GAINS][i] -= push;
    }
}

// Noise on the means of nearly transparent Gaussians, so that they search (3DGS-MCMC, eq. 9).
static void explore(const Trainer *t, Cloud *cloud, int layer, int begin, int end, double means_rate)
{
    Rng rng = fs_rng_new(((uint64_t)t->set->seed << 40) ^ ((uint64_t)t->step << 20) ^ (uint64_t)(begin / CHUNK) ^
                         ((uint64_t)layer << 60));
    for (int i = begin; i < end; i++) {
        float logit = cloud->field[CLOUD_OPACITIES][i];
        if (logit > -2.1972246f) continue; // opacity over a tenth
        float o = 1 / (1 + expf(-logit));
        float size = (float)(5e5 * means_rate) / (1 + expf(100 * (o - 0.005f)));
        const float *q = cloud->field[CLOUD_QUATS] + 4 * i, *s = cloud->field[CLOUD_SCALES] + 3 * i;
        double quat[4] = {q[0], q[1], q[2], q[3]}, r[9];
        fs_camera_quat_to_rotation(quat, r);
        float local[3];
        for (int k = 0; k < 3; k++) { // covariance times noise = R S^2 R^T n; R^T n is as normal as n
            float e = expf(s[k]);
            local[k] = e * e * fs_rng_normal(&rng) * size;
        }
        for (int k = 0; k < 3; k++)
            cloud->field[CLOUD_MEANS][3 * i + k] +=
                (float)r[3 * k] * local[0] + (float)r[3 * k + 1] * local[1] + (float)r[3 * k + 2] * local[2];
    }
}

static void clamp_field(float *x, size_t n, float low, float high)
{
    for (size_t i = 0; i < n; i++) x[i] = x[i] < low ? low : x[i] > high ? high : x[i];
}

static void update_job(void *context, int job, int worker)
{
    (void)worker;
    Update *u = context;
    Trainer *t = u->trainer;
    int l = 0;
    while (job >= u->first[l + 1]) l++;
    Cloud *cloud = &t->scene.cloud[l];
    CloudState *state = &t->state[l];
    RasterTask *task = &t->engine->task[l];
    int begin = (job - u->first[l]) * CHUNK, end = begin + CHUNK < cloud->n ? begin + CHUNK : cloud->n;
    regularise(t, cloud, task, begin, end);
    const ShadeKernels *shade = u->lit && l == LAYER_T_N ? t->engine->kernels.shade : NULL;
    const float *means = cloud->field[CLOUD_MEANS];
    float *colors = cloud->field[CLOUD_COLORS], *gains = cloud->field[CLOUD_GAINS];
    if (shade)
        shade->enter(&u->light, means, gains, task->seen, begin, end, colors, task->d_field[CLOUD_COLORS],
                     task->d_field[CLOUD_GAINS]);
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f], at = w * (size_t)begin;
        if (!w || (f == CLOUD_GAINS && t->scene.separation != SEPARATION_FULL)) continue;
        double rate = f == CLOUD_MEANS ? u->means_rate
                                       : rates[f].rate * (f == CLOUD_OPACITIES ? 1 : t->set->rate_scale) * u->settle;
        t->engine->kernels.adam->step_sparse(cloud->field[f] + at, task->d_field[f] + at, state->m.field[f] + at,
                                             state->v.field[f] + at, (size_t)(end - begin), (int)w, task->seen + begin,
                                             fs_adam_rate(rate, t->step));
    }
    if (gains) clamp_field(gains + begin, (size_t)(end - begin), GAIN_MIN, GAIN_MAX);
    if (shade) shade->leave(&u->light, means, gains, task->seen, begin, end, colors);
    float darkest = (float)(l == LAYER_R ? t->set->darkest : t->set->darkest / 2);
    if (l != LAYER_BETA) clamp_field(colors + 3 * begin, 3 * (size_t)(end - begin), darkest, 4);
    if (strcmp(t->set->densify, "relocate") == 0) explore(t, cloud, l, begin, end, u->means_rate);
}

static double settle(const Trainer *trainer)
{
    double share = trainer->set->settle, begin = (1 - share) * trainer->set->steps;
    return trainer->step > begin ? pow(0.1, (trainer->step - begin) / (share * trainer->set->steps)) : 1;
}

void fs_optimise_step(Trainer *trainer)
{
    Update u = {.trainer = trainer, .means_rate = fs_optimise_means_rate(trainer), .settle = settle(trainer)};
    if (fs_scene_lit(&trainer->scene) && trainer->scene.separation == SEPARATION_FULL) {
        u.lit = true;
        u.light = middle_light(trainer);
    }
    int jobs = 0;
    bool flash = trainer->last_flash;
    for (int l = 0; l < LAYERS; l++) {
        int n = trainer->scene.cloud[l].n;
        LayerLight other = flash ? LIT_BY_AMBIENT : LIT_BY_FLASH;
        bool steps = n && (trainer->scene.shared_geometry || fs_layers[l].light != other);
        u.first[l] = jobs;
        jobs += steps ? (n + CHUNK - 1) / CHUNK : 0;
    }
    u.first[LAYERS] = jobs;
    fs_threads_for(trainer->engine->threads, jobs, update_job, &u);
}

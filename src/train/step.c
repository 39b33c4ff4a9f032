// One training step: render the layers at a photo's pose, form the photo, compare, and send the gradients back.
//
//   I = encode(decode(T) + beta * decode(R)),  T = T_F for a flash photo, T_N without      (Flash-Splat, section 3)
//   L = w (0.8 L1 + 0.2 DSSIM) + linearity + smoothness of depth and beta                    (section 4 and the code)
#include <math.h>
#include <string.h>

#include "train/trainer.h"

#define STRIP 32       // rows per job
#define HOLES_FROM 0.4 // of all steps
#define HOLES_FULL 0.6
#define RETURN_MIN 0.01
#define RETURN_MAX 1.0

const char *const fs_loss_names[LOSS_TERMS] = {"l1",           "dssim",       "linearity", "beta_smooth",
                                               "depth_smooth", "gain_smooth", "holes"};

typedef struct Step {
    Trainer *trainer;
    const TrainView *view;
    RasterTask *task[LAYERS]; // NULL: not rendered in this step
    Layer T;                  // layer of the photo's lighting
    Planes beta, d_beta;      // 1 plane each
    Planes tau, d_tau;
    Planes mask;
    Planes black, d_black; // 3 planes of R where there is none
    Planes I, d_I, T_linear, R_linear, I_linear, other_linear;
    PearsonSums *pearson, pearson_total; // per strip, and all
    PaneView pane;
    PaneGradient *d_pane; // per strip
    int strips;
} Step;

static int strip_end(const Step *s, int strip)
{
    int end = (strip + 1) * STRIP;
    return end < s->view->photo.height ? end : s->view->photo.height;
}

static double *sums_of(const Step *s, int strip)
{
    return s->trainer->strip_sum + (size_t)strip * LOSS_TERMS;
}

static Planes rgb(const Planes *feature)
{
    Planes p = *feature;
    p.channels = 3;
    return p;
}

static Planes depth_of(const RasterTask *task, const Planes *planes)
{
    Planes p = *planes;
    p.px = fs_planes_row(planes, task->colors, 0);
    p.channels = 1;
    return p;
}

static void zero_rows(const Planes *p, int y0, int y1)
{
    for (int c = 0; c < p->channels; c++)
        memset(fs_planes_row(p, c, y0), 0, sizeof(float) * (size_t)p->stride * (size_t)(y1 - y0));
}

// ---- what each layer is rendered with ----

// Layers that take part in a step. With separate geometry both lightings are rendered, for the linearity term.
static int set_up_tasks(Step *s, const ShadeLight *light, const ShadeLight *back, RasterTask **list)
{
    Trainer *t = s->trainer;
    int n = 0;
    bool both = !t->scene.shared_geometry && t->set->linearity > 0;
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *cloud = &t->scene.cloud[l];
        LayerLight other = s->view->view->flash ? LIT_BY_AMBIENT : LIT_BY_FLASH;
        if (!cloud->n) continue;
        if (fs_layers[l].light == other && !both && !t->scene.shared_geometry) continue;
        RasterTask *task = s->task[l] = list[n++] = &t->engine->task[l];
        task->cloud = cloud;
        bool lit = fs_scene_lit(&t->scene) && s->view->view->flash;
        task->light = !lit ? NULL : l == LAYER_R ? back : light;
        task->colors = fs_layers[l].channels;
        task->depth = t->set->depth_smooth > 0 && l != LAYER_BETA;
        task->train = true;
        task->use_d_transmittance = t->set->opaque > 0 && l != LAYER_BETA;
    }
    s->T = t->scene.shared_geometry || !s->view->view->flash ? LAYER_T_N : LAYER_T_F;
    return n;
}

static ComposeArgs compose_args(Step *s, Planes rgb_planes[4])
{
    RasterTask *T = s->task[s->T], *R = s->task[LAYER_R];
    rgb_planes[0] = rgb(&T->feature);
    rgb_planes[1] = R ? rgb(&R->feature) : s->black;
    rgb_planes[2] = rgb(&T->d_feature);
    rgb_planes[3] = R ? rgb(&R->d_feature) : s->d_black;
    bool pane = s->trainer->scene.pane_beta;
    return (ComposeArgs){.tau = pane ? &s->tau : NULL,
                         .d_tau = pane ? &s->d_tau : NULL,
                         .T = &rgb_planes[0],
                         .R = &rgb_planes[1],
                         .beta = &s->beta,
                         .I = &s->I,
                         .T_linear = &s->T_linear,
                         .R_linear = &s->R_linear,
                         .I_linear = &s->I_linear,
                         .d_I = &s->d_I,
                         .d_T = &rgb_planes[2],
                         .d_R = &rgb_planes[3],
                         .d_beta = &s->d_beta,
                         .slope_floor = (float)s->trainer->set->slope_floor};
}

// A clipped pixel (mask 0) was at least as bright as its photo says: it has a say while the render is darker than that.
// Pixels outside an undistorted photo are 0 there, so they never have.
static void mask_rows(const Step *s, int y0, int y1)
{
    const TrainView *v = s->view;
    for (int y = y0; y < y1; y++) {
        const float *mask = fs_planes_row(&v->mask, 0, y);
        float *out = fs_planes_row(&s->mask, 0, y);
        for (int x = 0; x < v->mask.stride; x++) {
            float darker = 0;
            for (int c = 0; c < 3; c++) darker += fs_planes_row(&v->photo, c, y)[x] - fs_planes_row(&s->I, c, y)[x];
            out[x] = darker > 0 && mask[x] < 1 ? 1 : mask[x];
        }
    }
}

// ---- jobs over strips of rows ----

static void compose_job(void *context, int strip, int worker)
{
    (void)worker;
    Step *s = context;
    Trainer *t = s->trainer;
    int y0 = strip * STRIP, y1 = strip_end(s, strip);
    if (t->scene.pane_beta)
        t->engine->kernels.pane->forward(&s->pane, &s->beta, &s->tau, y0, y1);
    else
        fs_engine_sigmoid(&s->task[LAYER_BETA]->feature, &s->beta, y0, y1);
    Planes p[4];
    ComposeArgs args = compose_args(s, p);
    t->engine->kernels.compose->forward(&args, y0, y1);
    mask_rows(s, y0, y1);
    Layer other = s->T == LAYER_T_N ? LAYER_T_F : LAYER_T_N;
    if (!t->scene.shared_geometry && s->task[other]) {
        Planes o = rgb(&s->task[other]->feature);
        t->engine->kernels.compose->decode(&o, &s->other_linear, y0, y1);
        PearsonArgs pearson = {.X_linear = &s->T_linear, .Y_linear = &s->other_linear};
        s->pearson[strip] = t->engine->kernels.pearson->sums(&pearson, y0, y1);
    }
}

// Mean of the light that passes all of a layer's splats, over the layers: a dark surface that lets light of what lies
// behind it through would explain the photos as well, from where they were taken. What is found to be in front of
// another surface by mistake must fade before, so this sets in late.
static double holes(const Step *s, int y0, int y1)
{
    const Trainer *t = s->trainer;
    double sum = 0, ramp = ((double)t->step / t->set->steps - HOLES_FROM) / (HOLES_FULL - HOLES_FROM);
    float share = (float)(1 / ((double)s->beta.width * s->beta.height)),
          weight = (float)(t->set->opaque * fmin(fmax(ramp, 0), 1)) * share;
    for (int l = 0; l < LAYERS; l++) {
        if (!s->task[l] || !s->task[l]->use_d_transmittance) continue;
        for (int y = y0; y < y1; y++) {
            const float *passes = fs_planes_row(&s->task[l]->transmittance, 0, y);
            float *d_passes = fs_planes_row(&s->task[l]->d_transmittance, 0, y), row = 0;
            for (int x = 0; x < s->beta.width; x++) {
                row += passes[x];
                d_passes[x] = weight;
            }
            sum += (double)(row * share);
        }
    }
    return sum;
}

static void loss_job(void *context, int strip, int worker)
{
    Step *s = context;
    Trainer *t = s->trainer;
    const Kernels *k = &t->engine->kernels;
    int y0 = strip * STRIP, y1 = strip_end(s, strip);
    double *sum = sums_of(s, strip);
    memset(sum, 0, sizeof(double) * LOSS_TERMS);
    for (int l = 0; l < LAYERS; l++)
        if (s->task[l]) zero_rows(&s->task[l]->d_feature, y0, y1);
    zero_rows(&s->d_beta, y0, y1);
    zero_rows(&s->d_tau, y0, y1);
    PhotometricArgs photo = {.I = &s->I,
                             .Y = &s->view->photo,
                             .mu_Y = &s->view->mu,
                             .var_Y = &s->view->var,
                             .mask = &s->mask,
                             .lambda = (float)t->set->dssim,
                             .weight = (float)t->set->rgb_weight,
                             .d_I = &s->d_I,
                             .scratch = t->photometric_scratch[worker]};
    PhotometricSums p = k->photometric->loss(&photo, y0, y1);
    sum[LOSS_L1] = p.l1;
    sum[LOSS_DSSIM] = p.dssim;
    sum[LOSS_HOLES] = holes(s, y0, y1);
    Planes planes[4];
    ComposeArgs args = compose_args(s, planes);
    k->compose->backward(&args, y0, y1);
    for (int l = 0; l < LAYERS; l++) {
        if (!s->task[l] || !s->task[l]->depth) continue;
        Planes depth = depth_of(s->task[l], &s->task[l]->feature),
               d_depth = depth_of(s->task[l], &s->task[l]->d_feature);
        SmoothArgs smooth = {.map = &depth, .g = 2.0f, .weight = (float)t->set->depth_smooth, .d_map = &d_depth};
        sum[LOSS_DEPTH_SMOOTH] += k->smooth->loss(&smooth, y0, y1);
    }
    if (!t->scene.pane_beta && t->set->beta_smooth > 0) {
        SmoothArgs smooth = {.map = &s->beta, .g = 2.0f, .weight = (float)t->set->beta_smooth, .d_map = &s->d_beta};
        sum[LOSS_BETA_SMOOTH] = k->smooth->loss(&smooth, y0, y1);
    }
    Layer other = s->T == LAYER_T_N ? LAYER_T_F : LAYER_T_N;
    if (!t->scene.shared_geometry && s->task[other]) {
        Planes x = rgb(&s->task[s->T]->feature), y = rgb(&s->task[other]->feature);
        Planes d_x = rgb(&s->task[s->T]->d_feature), d_y = rgb(&s->task[other]->d_feature);
        PearsonArgs pearson = {.X = &x,
                               .Y = &y,
                               .X_linear = &s->T_linear,
                               .Y_linear = &s->other_linear,
                               .d_X = &d_x,
                               .d_Y = &d_y,
                               .weight = (float)t->set->linearity};
        k->pearson->gradient(&pearson, &s->pearson_total, y0, y1);
    }
    if (t->scene.pane_beta) s->d_pane[strip] = k->pane->backward(&s->pane, &s->d_beta, &s->d_tau, y0, y1);
}

// beta = sigmoid(x): d_x = d_beta beta (1 - beta)
static void beta_back_job(void *context, int strip, int worker)
{
    (void)worker;
    Step *s = context;
    int y1 = strip_end(s, strip);
    for (int y = strip * STRIP; y < y1; y++) {
        const float *beta = fs_planes_row(&s->beta, 0, y), *d_beta = fs_planes_row(&s->d_beta, 0, y);
        float *d_x = fs_planes_row(&s->task[LAYER_BETA]->d_feature, 0, y);
        for (int x = 0; x < s->beta.width; x++) d_x[x] = d_beta[x] * beta[x] * (1 - beta[x]);
    }
}

// ---- the step ----

static void add_pearson(Step *s)
{
    s->pearson_total = (PearsonSums){0};
    for (int i = 0; i < s->strips; i++) {
        const PearsonSums *p = &s->pearson[i];
        PearsonSums *q = &s->pearson_total;
        *q = (PearsonSums){q->n + p->n, q->x + p->x, q->y + p->y, q->xx + p->xx, q->yy + p->yy, q->xy + p->xy};
    }
}

static void adam_scalar(double *x, double g, double *m, double *v, double rate, int step)
{
    *m = 0.9 * *m + 0.1 * g;
    *v = 0.999 * *v + 0.001 * g * g;
    *x -= rate * (*m / (1 - pow(0.9, step))) / (sqrt(*v / (1 - pow(0.999, step))) + 1e-15);
}

// The few numbers that belong to the whole scene: pane, the flash's colour against the ambient light, its return.
static void update_globals(Step *s)
{
    Trainer *t = s->trainer;
    Scene *scene = &t->scene;
    GlobalState *g = &t->globals;
    int step = t->step + 1;
    if (scene->separation == SEPARATION_NONE) return;
    if (scene->pane_beta) {
        PaneGradient d = {0};
        for (int i = 0; i < s->strips; i++) {
            for (int k = 0; k < 3; k++) d.normal[k] += s->d_pane[i].normal[k];
            d.dimming += s->d_pane[i].dimming;
        }
        double *n = scene->pane.normal;
        for (int i = 0; i < 3; i++) adam_scalar(&n[i], d.normal[i], &g->m[i], &g->v[i], 5e-3, step);
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int i = 0; i < 3; i++) n[i] /= length;
        adam_scalar(&scene->pane.dimming, d.dimming, &g->m[3], &g->v[3], 1e-3, step);
        scene->pane.dimming = fmin(fmax(scene->pane.dimming, 0.02), 0.5);
    }
    if (!fs_scene_lit(scene) || !s->view->view->flash) return;
    for (int i = 0; i < 3; i++) {
        double x = log(scene->gain_color[i]);
        adam_scalar(&x, t->engine->task[LAYER_T_N].d_tint[i] * scene->gain_color[i], &g->m[4 + i], &g->v[4 + i], 1e-3,
                    step);
        scene->gain_color[i] = exp(x);
    }
    const RasterTask *R = s->task[LAYER_R];
    if (!R || !R->light) return;
    double d_return = 0;
    for (int i = 0; i < 3; i++) d_return += R->d_tint[i] * scene->gain_color[i];
    double x = log(scene->flash_return);
    adam_scalar(&x, d_return * scene->flash_return, &g->m[7], &g->v[7], 5e-3, step);
    scene->flash_return = exp(fmin(fmax(x, log(RETURN_MIN)), log(RETURN_MAX)));
}

void fs_step_run(Trainer *trainer, const TrainView *view)
{
    Step step = {.trainer = trainer, .view = view}, *s = &step;
    Engine *e = trainer->engine;
    const Camera *camera = &view->view->camera;
    ShadeLight light = fs_engine_light(&trainer->scene, camera), back = fs_engine_return(&trainer->scene, camera);
    RasterTask *list[LAYERS];
    fs_arena_reset(&e->arena);
    int n = set_up_tasks(s, &light, &back, list);
    fs_raster_task_forward(&e->kernels, e->threads, list, n, camera, (float)(FS_ENGINE_NEAR * trainer->scene.extent));
    s->beta = fs_engine_planes(e, camera, 1);
    s->d_beta = fs_engine_planes(e, camera, 1);
    s->tau = fs_engine_planes(e, camera, 1);
    s->mask = fs_engine_planes(e, camera, 1);
    s->d_tau = fs_engine_planes(e, camera, 1);
    if (!s->task[LAYER_R]) {
        s->black = fs_engine_planes(e, camera, 3);
        s->d_black = fs_engine_planes(e, camera, 3);
        zero_rows(&s->black, 0, camera->height);
        zero_rows(&s->d_black, 0, camera->height);
    }
    s->I = fs_engine_planes(e, camera, 3);
    s->d_I = fs_engine_planes(e, camera, 3);
    s->T_linear = fs_engine_planes(e, camera, 3);
    s->R_linear = fs_engine_planes(e, camera, 3);
    s->I_linear = fs_engine_planes(e, camera, 3);
    s->other_linear = fs_engine_planes(e, camera, 3);
    s->strips = (camera->height + STRIP - 1) / STRIP;
    s->d_pane = ARENA_NEW(&e->arena, PaneGradient, s->strips);
    s->pane = fs_pane_view(&trainer->scene.pane, camera);
    s->pearson = ARENA_NEW(&e->arena, PearsonSums, s->strips);
    memset(s->pearson, 0, sizeof *s->pearson * (size_t)s->strips);
    fs_threads_for(e->threads, s->strips, compose_job, s);
    add_pearson(s);
    fs_threads_for(e->threads, s->strips, loss_job, s);
    memset(trainer->loss, 0, sizeof trainer->loss);
    for (int i = 0; i < s->strips; i++)
        for (int k = 0; k < LOSS_TERMS; k++) trainer->loss[k] += sums_of(s, i)[k];
    if (s->pearson_total.n > 0) trainer->loss[LOSS_LINEARITY] = fs_pearson_fit(&s->pearson_total).loss;
    if (s->task[LAYER_BETA]) fs_threads_for(e->threads, s->strips, beta_back_job, s);
    fs_raster_task_backward(&e->kernels, e->threads, list, n);
    if (trainer->scene.shared_geometry)
        trainer->loss[LOSS_GAIN_SMOOTH] = fs_gains_smooth(trainer, e->task[LAYER_T_N].d_field[CLOUD_GAINS]);
    update_globals(s);
    trainer->step++;
    trainer->last_flash = view->view->flash;
}

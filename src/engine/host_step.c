// One training step: render the layers at a photo's pose, form the photo, compare, send the gradients back, Adam.
//
//   I = encode(tau decode(T) + beta decode(R)),  T = T_F for a flash photo, T_N without    (Flash-Splat, section 3)
//   L = the terms of engine/loss.h
#include <math.h>
#include <string.h>

#include "base/threads.h"
#include "engine/host_pixels.h"
#include "engine/scratch.h"
#include "engine/update.h"
#include "engine/view_loss.h"
#include "image/fill.h"

#define STEP_SAMPLES 32768.0 // of the rays of a step through radiance fields
#define STEP_RAYS 4096.0
#define RATE_OCCLUSION 2 // 4 finds more that is not there, and less of who is (T_N 0.8 dB lower with a photographer)

typedef struct StripSums {
    double loss[LOSS_TERMS];
    PearsonSums pearson;
    PaneGradient pane;
    CalibrationGradient calibration;
    float *d_q; // of the photo's occlusion
} StripSums;

typedef struct Step {
    HostEngine *engine;
    const StepArgs *args;
    HostView *view;
    HostPixels pixels; // of the view, that are looked at
    ViewImages images;
    RasterPass pass, back; // what is rasterised; what gets gradients
    ViewLoss loss;
    Planes mask, T_linear, other_linear; // both without the pane, for the linearity term
    PearsonSums pearson;
    void **scratch;          // one per thread
    StripSums *strips;       // added up in their order
    OcclusionSums *open;     // one per strip, as they: R where nobody hides it; NULL: nobody asks
    OcclusionSums *residual; // and the photo less its render
    int n_strips;
} Step;

// ---- what takes part ----

static RasterTask *add(Step *s, int number, const PlanPart *part)
{
    if (!part->there) return NULL;
    RasterTask *task = fs_host_engine_task(s->engine, number, part);
    LossLooks looks = fs_loss_looks(s->args->weight, part->layer);
    task->train = true;
    task->depth = looks.depth;
    task->use_d_transmittance = looks.transmittance;
    fs_raster_pass_add(&s->pass, task);
    fs_raster_pass_add(&s->back, task);
    return s->loss.task[part->layer] = task;
}

// The T of the other lighting, for the linearity term. A cloud gets no gradients: its own photos step it; in a radiance
// field both are one.
static void add_other(Step *s)
{
    ViewPlan plan = fs_view_plan(&s->engine->scene, &s->pixels.camera, !s->view->flash);
    if (!plan.T.there || plan.T.layer == s->images.plan.T.layer) return;
    RasterTask *task = fs_host_engine_task(s->engine, TASK_OTHER_T, &plan.T);
    fs_raster_pass_add(&s->pass, task);
    s->loss.other = task;
    task->train = s->engine->volumes.field != NULL;
    if (task->train) fs_raster_pass_add(&s->back, task);
    bool dimmed = s->images.plan.pane_beta; // images.T_linear is
    s->T_linear = dimmed ? fs_scratch_planes(&s->engine->arena, &s->pixels.camera, 3) : s->images.T_linear;
    s->other_linear = fs_scratch_planes(&s->engine->arena, &s->pixels.camera, 3);
}

static int new_sums(const Step *s, OcclusionSums **sums, FsError *err)
{
    *sums = ARENA_NEW(&s->engine->arena, OcclusionSums, s->n_strips);
    if (!*sums) return fs_error_memory(err);
    memset(*sums, 0, sizeof **sums * (size_t)s->n_strips);
    return 0;
}

static int set_up_strips(Step *s, FsError *err)
{
    HostEngine *e = s->engine;
    const Camera *camera = &s->pixels.camera;
    int threads = e->threads ? fs_threads_count(e->threads) : 1;
    s->n_strips = fs_host_engine_strips(e, camera->height);
    s->strips = ARENA_NEW(&e->arena, StripSums, s->n_strips);
    s->scratch = ARENA_NEW(&e->arena, void *, threads);
    for (int i = 0; i < threads && s->scratch; i++)
        s->scratch[i] = fs_arena_alloc(&e->arena, fs_photometric_scratch(camera->width));
    if (e->arena.failed) return fs_error_memory(err);
    memset(s->strips, 0, sizeof *s->strips * (size_t)s->n_strips);
    if (s->args->residual) MUST(new_sums(s, &s->residual, err));
    if (!s->images.occlusion) return 0;
    size_t cells = (size_t)OCCLUSION_CELLS * (size_t)s->n_strips;
    float *d_q = ARENA_NEW(&e->arena, float, cells);
    if (!d_q) return fs_error_memory(err);
    memset(d_q, 0, sizeof *d_q * cells);
    for (int i = 0; i < s->n_strips; i++) s->strips[i].d_q = d_q + (size_t)i * OCCLUSION_CELLS;
    bool hides = s->images.R && s->args->weight[LOSS_UNSEEN] > 0;
    return hides ? new_sums(s, &s->open, err) : 0;
}

// ---- the pixels that are looked at ----

// Radiance fields are too slow for all of a photo: a step takes as many pixels as rays with that many samples may be.
static int stride_of(const Step *s)
{
    const Radiance *field = &s->engine->scene.field;
    double pace = 0;
    for (int v = 0; v < VOLUMES; v++) {
        if (!field->shape.colors[v]) continue;
        double samples = (double)*fs_radiance_part(field, (Volume)v, RADIANCE_PACE);
        if (s->args->every > 1) samples = 0; // the pace is that of all samples
        pace += samples > 1 ? samples : samples > 0 ? 1 : field->shape.samples / fmax(s->args->every, 1);
    }
    double rays = fmin(STEP_SAMPLES / pace, STEP_RAYS);
    int stride = 1;
    while ((double)((s->view->camera.width - 1) / stride + 1) * ((s->view->camera.height - 1) / stride + 1) > rays)
        stride++;
    return stride;
}

static void look_at(Step *s)
{
    const bool field = fs_radiance_is(&s->engine->scene.field);
    int stride[2], rays = field ? stride_of(s) : 0;
    for (int k = 0; k < 2; k++) stride[k] = field ? rays : s->args->stride[k] > 1 ? s->args->stride[k] : 1;
    Rng rng = fs_rng_new(s->args->seed * 1000003u + (uint64_t)s->args->step);
    fs_host_pixels_pick(&s->pixels, &s->engine->arena, s->view, stride, &rng);
}

static uint64_t jitter_of(const Step *s)
{
    return fs_rng_new(s->args->seed * 999983u + (uint64_t)s->args->step).state | 1;
}

static int set_up(Step *s, FsError *err)
{
    HostEngine *e = s->engine;
    const Camera *camera = &s->pixels.camera;
    ViewPlan *plan = &s->images.plan;
    fs_arena_reset(&e->arena);
    look_at(s);
    s->pass = (RasterPass){&e->kernels,
                           e->threads,
                           {NULL},
                           0,
                           camera,
                           (float)(FS_NEAR * e->scene.extent),
                           &e->volumes,
                           jitter_of(s),
                           s->args->every,
                           s->args->blind,
                           {s->pixels.stride[0], s->pixels.stride[1]}};
    s->back = s->pass;
    *plan = fs_view_plan(&e->scene, camera, s->view->flash);
    const float flash[2] = {fs_host_engine_flash(s->view, PHOTO_T), fs_host_engine_flash(s->view, PHOTO_R)};
    fs_view_plan_photo(plan, &e->scene, camera, &s->view->state, s->view->exposure_gain, flash, s->args->learn);
    const float per_px = fs_view_plan_per_px(&s->view->camera);
    for (int k = 0; k < 2; k++) plan->calibration.per_px[k] = per_px * (float)s->pixels.stride[k];
    if (!plan->T.there)
        return fs_error_set(err, FS_ERR_INPUT, "training: no cloud %s for photos of that lighting",
                            fs_layers[plan->T.layer].name);
    s->images.T = add(s, TASK_T, &plan->T);
    s->images.R = add(s, TASK_R, &plan->R);
    s->images.beta = add(s, TASK_BETA, &plan->beta);
    s->images.cover = plan->covers && !s->images.T->depth ? s->images.T : NULL; // one of the two can be had
    if (s->images.cover) s->images.T->cover = true;
    s->images.slope_floor = (float)s->args->slope_floor;
    if (s->view->occlusion && plan->pane_beta) s->images.occlusion = s->view->occlusion->q;
    if (fs_pane_veil_is(&e->scene.veil)) {
        s->images.texture = e->scene.veil.light.px;
        s->images.veil_view = fs_view_plan_scene_veil(&e->scene, camera, fs_host_engine_veil_light(s->view));
    }
    fs_view_images_set_up(&s->images, &e->kernels, &e->arena, camera, true);
    s->mask = fs_scratch_planes(&e->arena, camera, 1);
    if (s->args->weight[LOSS_LINEARITY] > 0) add_other(s);
    MUST(set_up_strips(s, err));
    s->loss.kernels = &e->kernels;
    s->loss.weight = s->args->weight;
    s->loss.images = &s->images;
    s->loss.photo = &s->pixels.photo;
    s->loss.mu = &s->pixels.mu;
    s->loss.var = &s->pixels.var;
    s->loss.mask = &s->mask;
    s->loss.T_linear = &s->T_linear;
    s->loss.other_linear = &s->other_linear;
    s->loss.pearson = &s->pearson;
    return 0;
}

// ---- jobs over strips of rows ----

static void windows(const Step *s, int y0, int y1, void *scratch)
{
    const HostPixels *p = &s->pixels;
    PhotometricArgs args = {.I = &p->photo, .Y = &p->photo, .mu_Y = &p->mu, .var_Y = &p->var, .scratch = scratch};
    if (s->args->weight[LOSS_DSSIM] > 0 || s->args->weight[LOSS_CONTRAST] > 0)
        s->engine->kernels.photometric->target_stats(&args, y0, y1);
}

static void forward_job(void *context, int strip, int worker)
{
    Step *s = context;
    const Kernels *k = &s->engine->kernels;
    int y0 = strip * s->engine->strip, y1 = fs_host_engine_strip_end(s->engine, strip, s->pixels.camera.height);
    windows(s, y0, y1, s->scratch[worker]);
    fs_view_images_forward(&s->images, y0, y1);
    k->pixelwise->clipped(&s->pixels.trust, &s->pixels.photo, &s->images.P, &s->mask, y0, y1);
    if (s->open) k->occlusion->open(s->images.occlusion, &s->images.R->feature, &s->open[strip], y0, y1);
    if (s->residual) k->occlusion->differ(&s->pixels.photo, &s->images.P, &s->mask, &s->residual[strip], y0, y1);
    if (!s->loss.other) return;
    Planes T = fs_view_images_rgb(&s->images.T->feature), other = fs_view_images_rgb(&s->loss.other->feature);
    if (s->T_linear.px != s->images.T_linear.px) k->compose->decode(&T, &s->T_linear, y0, y1);
    k->compose->decode(&other, &s->other_linear, y0, y1);
    PearsonArgs args = {.X_linear = &s->T_linear, .Y_linear = &s->other_linear};
    s->strips[strip].pearson = k->pearson->sums(&args, y0, y1);
}

// What is clipped without the flash, and its edge, is mostly a lamp, and lamps are mostly mirrored: T and R could each
// be as bright. Those known to be behind the pane both learn.
static void leave_lamps(const Step *s, int y0, int y1)
{
    const HostEngine *e = s->engine;
    const bool gaussians = e->scene.shared_geometry && !fs_radiance_is(&e->scene.field);
    if (!s->args->lamps_mirrored || s->view->flash || !s->images.R || !gaussians) return;
    const int width = s->pixels.camera.width, height = s->pixels.camera.height;
    for (int y = y0; y < y1; y++) {
        const float *trust = fs_planes_row(&s->pixels.trust, 0, y);
        const unsigned char *lamps = s->view->lamps + y * OCCLUSION_HEIGHT / height * OCCLUSION_WIDTH;
        for (int c = 0; c < s->images.T->colors; c++) {
            float *d = fs_planes_row(&s->images.T->d_feature, c, y);
            for (int x = 0; x < width; x++) d[x] = trust[x] < 1 && !lamps[x * OCCLUSION_WIDTH / width] ? 0 : d[x];
        }
    }
}

static void backward_job(void *context, int strip, int worker)
{
    Step *s = context;
    ViewLoss loss = s->loss;
    StripSums *sums = &s->strips[strip];
    int y0 = strip * s->engine->strip, y1 = fs_host_engine_strip_end(s->engine, strip, s->pixels.camera.height);
    loss.scratch = s->scratch[worker];
    for (int t = 0; t < s->back.n; t++) fs_planes_zero(&s->back.task[t]->d_feature, y0, y1);
    fs_view_images_zero(&s->images, y0, y1);
    for (int k = 0; k < LOSS_TERMS; k++) {
        // What d_P says goes back through the image equation as soon as the photo's terms are done.
        if (k == LOSS_CONTRAST + 1) {
            fs_view_images_backward(&s->images, y0, y1, &sums->calibration);
            leave_lamps(s, y0, y1);
        }
        bool wanted = s->args->weight[k] > 0 || k == LOSS_L1; // l1's row is dssim's and contrast's too
        if (wanted && fs_loss_terms[k].rows) fs_loss_terms[k].rows(&loss, y0, y1, sums->loss);
    }
    sums->pane = fs_view_images_backward_beta(&s->images, y0, y1, sums->d_q);
}

// ---- sums ----

static void add_pearson(Step *s)
{
    for (int i = 0; i < s->n_strips; i++) {
        const PearsonSums *p = &s->strips[i].pearson;
        PearsonSums *q = &s->pearson;
        *q = (PearsonSums){q->n + p->n, q->x + p->x, q->y + p->y, q->xx + p->xx, q->yy + p->yy, q->xy + p->xy};
    }
}

// The first takes all.
static void add_sums(OcclusionSums *sums, int n)
{
    for (int i = 1; i < n; i++) {
        for (int k = 0; k < 3 * OCCLUSION_CELLS; k++) sums->rgb[k] += sums[i].rgb[k];
        for (int k = 0; k < OCCLUSION_CELLS; k++) sums->n[k] += sums[i].n[k], sums->all[k] += sums[i].all[k];
    }
}

// What the mirrored scene shall be where it is hidden, and what the photo has beyond its render.
static int look_around(Step *s, FsError *err)
{
    if (s->residual) add_sums(s->residual, s->n_strips);
    for (int i = 0; s->residual && i < 3 * OCCLUSION_CELLS; i++)
        s->args->residual[i] = s->residual->rgb[i] / fmaxf(s->residual->n[i / 3], 1);
    if (!s->open) return 0;
    add_sums(s->open, s->n_strips);
    float *around = s->open->rgb, *share = s->open->n, *room;
    room = ARENA_NEW(&s->engine->arena, float, fs_fill_room(OCCLUSION_WIDTH, OCCLUSION_HEIGHT, 3));
    if (!room) return fs_error_memory(err);
    for (int i = 0; i < OCCLUSION_CELLS; i++) { // a cell of which little is seen is mostly as those around it
        float pixels = fmaxf(s->open->all[i], 1);
        for (int c = 0; c < 3; c++) around[3 * i + c] /= pixels;
        share[i] /= pixels;
    }
    if (fs_fill_holes_in(room, around, share, OCCLUSION_WIDTH, OCCLUSION_HEIGHT, 3)) s->loss.around = around;
    return 0;
}

static void add_strips(const Step *s, Update *update, StepResult *result)
{
    PaneGradient *pane = &update->pane;
    CalibrationGradient *sum = &update->calibration;
    for (int i = 0; i < s->n_strips; i++) {
        for (int k = 0; k < LOSS_TERMS; k++) result->loss[k] += s->strips[i].loss[k];
        const PaneGradient *p = &s->strips[i].pane;
        const CalibrationGradient *c = &s->strips[i].calibration;
        for (int k = 0; k < 3; k++) pane->normal[k] += p->normal[k];
        pane->dimming += p->dimming;
        pane->T += p->T;
        pane->R += p->R;
        for (int k = 0; k < 3; k++) sum->white[k] += c->white[k];
        for (int k = 0; k < FS_OPTICS_VIGNETTING; k++) sum->vignetting[k] += c->vignetting[k];
        for (int k = 0; k < FS_OPTICS_KNOTS; k++) sum->response[k] += c->response[k];
    }
    if (s->pearson.n > 0) result->loss[LOSS_LINEARITY] = fs_pearson_fit(&s->pearson).loss;
    for (int l = 0; l < LAYERS; l++) result->visible[l] = s->loss.task[l] ? s->loss.task[l]->n_visible : 0;
}

static void step_occlusion(const Step *s)
{
    OcclusionState *state = s->view->occlusion;
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        float d = state->cost[i];
        for (int k = 0; k < s->n_strips; k++) d += OCCLUSION_CELLS * s->strips[k].d_q[i];
        float q = state->q[i] - (float)(RATE_OCCLUSION * s->args->settle) * d;
        state->q[i] = q < 0 ? 0 : q > 1 ? 1 : q;
    }
}

// One thread does it all: cells that two strips see have one sum.
static int step_veil(const Step *s, double d_ambient[3], FsError *err)
{
    HostEngine *e = s->engine;
    const Veil *veil = &e->scene.veil;
    size_t n = fs_image_values(&veil->light);
    float *x = veil->light.px, *d = ARENA_NEW(&e->arena, float, n);
    if (!d) return fs_error_memory(err);
    memset(d, 0, sizeof *d * n);
    e->kernels.veil->backward(&s->images.veil_view, x, &s->images.d_veil, d, d_ambient, 0, s->pixels.camera.height);
    AdamFields fields = {x, d, e->state.veil_m, e->state.veil_v};
    e->kernels.adam->step(&fields, n, fs_adam_rate(s->args->veil_rate * veil->unit, s->args->step + 1));
    for (size_t i = 0; i < n; i++) x[i] = x[i] > 0 ? x[i] : 0;
    return 0;
}

int fs_host_step(Engine *base, const StepArgs *args, StepResult *result, FsError *err)
{
    HostEngine *e = fs_host_engine(base);
    Step step = {.engine = e, .args = args, .view = &e->views[args->view]}, *s = &step;
    int rc;
    TRY(fs_host_engine_need_state(e, err));
    TRY(set_up(s, err));
    TRY(fs_host_engine_raster(e)->forward(&s->pass, err));
    fs_threads_for(e->threads, s->n_strips, forward_job, s);
    add_pearson(s);
    TRY(look_around(s, err));
    fs_threads_for(e->threads, s->n_strips, backward_job, s);
    fs_host_engine_raster(e)->backward(&s->back);
    Update update = {.engine = e,
                     .args = args,
                     .photo = s->view,
                     .plan = &s->images.plan,
                     .task = {[LAYER_R] = s->images.R, [LAYER_BETA] = s->images.beta}};
    add_strips(s, &update, result);
    if (s->images.occlusion) step_occlusion(s);
    if (s->images.texture) TRY(step_veil(s, update.veil_ambient, err));
    update.task[s->images.plan.T.layer] = s->images.T;
    TRY(fs_update_run(&update, result, err));
fail:
    return rc;
}

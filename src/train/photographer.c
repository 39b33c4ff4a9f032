// The photographer's own mirror image: dark, unlit by the flash, and at another place of the mirrored room in each
// photo, so that it belongs to neither scene. Every photo learns which part of the mirrored light does not reach it
// (kernels/occlusion.h), cell by cell and little of it at first. But all photos show that figure in the same
// directions as seen from the mirror image of the camera, which lies along the pane's normal: drawn there, the mean
// over the photos is its portrait, where there is someone. Within its outline what is learned is little, since the
// mirrored scene soon is as dark there; filled, it hands that part of the scene over to those photos that see it clear.
//
// All this is looked for on small photos before training begins, from the same start: a capture without such a figure
// is trained as if nobody had looked.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "image/bilinear.h"
#include "train/region.h"
#include "train/train_constants.h"
#include "train/trainer.h"

typedef struct Portrait {
    double ahead[3], right[3], up[3]; // world: towards the mirror image, tangents of REACH to the sides
    float q[REGION_SIDE * REGION_SIDE];
    Region figure, near; // near: with some cells around it
} Portrait;

int fs_photographer_up(Trainer *trainer, FsError *err)
{
    for (int v = 0; trainer->occlusion && v < trainer->n_views; v++)
        MUST(fs_engine_occlusion_up(trainer->engine, v, &trainer->occlusion[v], err));
    return 0;
}

int fs_photographer_down(Trainer *trainer, FsError *err)
{
    for (int v = 0; trainer->occlusion && v < trainer->n_views; v++)
        MUST(fs_engine_occlusion_down(trainer->engine, v, &trainer->occlusion[v], err));
    return 0;
}

// ---- the portrait ----

static void direct(Portrait *p, const Trainer *trainer, const double n[3])
{
    double ahead[3] = {0}, up[3] = {0};
    for (int v = 0; v < trainer->n_views; v++)
        for (int k = 0; k < 3; k++) {
            up[k] -= trainer->views[v]->camera.w2c[4 + k];
            ahead[k] += trainer->views[v]->camera.w2c[8 + k];
        }
    double scale = (v3_dot(n, ahead) < 0 ? -1 : 1) / fmax(sqrt(v3_dot(n, n)), 1e-12);
    for (int k = 0; k < 3; k++) p->ahead[k] = scale * n[k];
    double along = v3_dot(up, p->ahead);
    for (int k = 0; k < 3; k++) p->up[k] = up[k] - along * p->ahead[k];
    double length = sqrt(v3_dot(p->up, p->up));
    for (int k = 0; k < 3; k++) p->up[k] /= fmax(length, 1e-12);
    v3_cross(p->ahead, p->up, p->right);
}

// A photo's q at a place, 0..1 of its sides, linear between the middles of cells.
static double between(const float *q, double x, double y)
{
    x = fmin(fmax(x * OCCLUSION_WIDTH - 0.5, 0), OCCLUSION_WIDTH - 1);
    y = fmin(fmax(y * OCCLUSION_HEIGHT - 0.5, 0), OCCLUSION_HEIGHT - 1);
    Bilinear at = fs_bilinear_at(x, y, OCCLUSION_WIDTH, OCCLUSION_HEIGHT);
    return (double)fs_bilinear_value(&at, q, 1, 0);
}

// The mean over the photos that look that way, where enough do.
static float mean(const Portrait *p, const Trainer *trainer, double u, double w)
{
    double d[3], sum = 0;
    int n = 0;
    for (int k = 0; k < 3; k++) d[k] = p->ahead[k] + u * p->right[k] + w * p->up[k];
    for (int v = 0; v < trainer->n_views; v++) {
        const Camera *c = &trainer->views[v]->camera;
        double z = v3_dot(c->w2c + 8, d);
        double x = (v3_dot(c->w2c, d) / z * c->fx + c->cx) / c->width;
        double y = (v3_dot(c->w2c + 4, d) / z * c->fy + c->cy) / c->height;
        if (!(z > 0) || !(x >= 0) || !(x < 1) || !(y >= 0) || !(y < 1)) continue;
        sum += between(trainer->occlusion[v].q, x, y);
        n++;
    }
    return n >= PORTRAIT_PHOTOS && 4 * n >= trainer->n_views ? (float)(sum / n) : 0;
}

// The median, where anything was seen.
static float usual(const float *q)
{
    float sorted[REGION_SIDE * REGION_SIDE];
    int n = 0;
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++)
        if (q[i] > 0) sorted[n++] = q[i];
    fs_order_floats(sorted, (size_t)n);
    return n ? sorted[n / 2] : 0;
}

static bool drawn(const Portrait *p)
{
    return memchr(p->figure.in, 1, sizeof p->figure.in) != NULL;
}

static void draw(Portrait *p, const Trainer *trainer)
{
    RegionRule rule = {PORTRAIT_OUTLINE, PORTRAIT_STANDS_OUT, PORTRAIT_GAP, PORTRAIT_LEAST};
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++) {
        double u = (i % REGION_SIDE + 0.5) / REGION_SIDE * 2 - 1, w = 1 - (i / REGION_SIDE + 0.5) / REGION_SIDE * 2;
        p->q[i] = mean(p, trainer, u * PORTRAIT_REACH, w * PORTRAIT_REACH);
    }
    p->figure.width = p->figure.height = REGION_SIDE;
    float noise = drawn(p) ? 0 : usual(p->q); // of what is not filled as yet
    rule.threshold = fmaxf(rule.threshold, PORTRAIT_ABOVE * noise);
    rule.stands_out *= (float)sqrt(fmax(1, PORTRAIT_USUAL / trainer->n_views)); // a mean of few is noisy
    rule.stands_out = fmaxf(rule.stands_out, rule.threshold / 2);
    fs_region_find(&p->figure, p->q, &rule);
    double sum = 0, n = 0;
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++)
        if (p->figure.in[i]) sum += (double)p->q[i], n++;
    float edge = (float)(PORTRAIT_EDGE * sum / fmax(n, 1));
    if (edge > rule.threshold) { // of one that was filled before: it would grow each time
        rule.threshold = edge;
        fs_region_find(&p->figure, p->q, &rule);
    }
    p->near = p->figure;
    fs_region_spread(&p->near, 1, PORTRAIT_NEAR);
}

// Whoever takes photos stands on the floor, and legs are dark before what is dark anyway: below what was found there is
// more.
static void complete(Portrait *p)
{
    fs_region_complete(&p->figure, PORTRAIT_HEIGHT);
    p->near = p->figure;
    fs_region_spread(&p->near, 1, PORTRAIT_NEAR);
}

// ---- back to the photos ----

// The cell of the portrait that a photo's cell shows; -1: it looks past it.
static int portrait_cell(const Portrait *p, const Camera *c, int cell)
{
    double x = (cell % OCCLUSION_WIDTH + 0.5) / OCCLUSION_WIDTH, y = (cell / OCCLUSION_WIDTH + 0.5) / OCCLUSION_HEIGHT;
    const double ray[3] = {(x * c->width - c->cx) / c->fx, (y * c->height - c->cy) / c->fy, 1};
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = ray[0] * c->w2c[k] + ray[1] * c->w2c[4 + k] + ray[2] * c->w2c[8 + k];
    double z = PORTRAIT_REACH * v3_dot(d, p->ahead);
    double i = (v3_dot(d, p->right) / z + 1) / 2 * REGION_SIDE, j = (1 - v3_dot(d, p->up) / z) / 2 * REGION_SIDE;
    if (!(z > 0) || !(i >= 0) || !(i < REGION_SIDE) || !(j >= 0) || !(j < REGION_SIDE)) return -1;
    return (int)j * REGION_SIDE + (int)i;
}

// How much of the photo the figure covers.
static double fill(const Portrait *p, const Camera *camera, OcclusionState *state)
{
    double sum = 0;
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        int at = portrait_cell(p, camera, i);
        bool in = at >= 0 && p->figure.in[at], near = at >= 0 && p->near.in[at];
        state->q[i] = in ? 1 : near ? state->q[i] : 0;
        state->cost[i] = in ? -OCCLUSION_COST : near ? OCCLUSION_COST : OCCLUSION_NEVER;
        sum += in;
    }
    return sum / OCCLUSION_CELLS;
}

static double fill_all(Trainer *trainer, const Portrait *p)
{
    double share = 0;
    for (int v = 0; v < trainer->n_views; v++)
        share += fill(p, &trainer->views[v]->camera, &trainer->occlusion[v]) / trainer->n_views;
    return share;
}

// ---- the search ----

// DSSIM makes outlines stand out; what it does to the scenes' light (kernels/photometric.h) goes with them.
static void weigh(double weight[LOSS_TERMS])
{
    double photo = weight[LOSS_L1] + weight[LOSS_DSSIM] + weight[LOSS_CONTRAST];
    weight[LOSS_L1] = (1 - PORTRAIT_DSSIM) * photo;
    weight[LOSS_DSSIM] = PORTRAIT_DSSIM * photo;
    weight[LOSS_CONTRAST] = 0;
}

static int steps(Trainer *trainer, int from, int to, FsError *err)
{
    for (int step = from; step < to; step++) {
        StepArgs args;
        StepResult result;
        if (fs_log_cancelled(&trainer->project->log))
            return fs_error_set(err, FS_ERR_CANCELLED, "stopped before step 1 of %d; run it again",
                                trainer->set->steps);
        fs_schedule_step(trainer->set, &trainer->scene, step, &args);
        weigh(args.weight);
        args.learn = trainer->learn;
        args.view = fs_views_at_step(trainer, step);
        MUST(fs_engine_step(trainer->engine, &args, &result, err));
    }
    return 0;
}

// 1: the figure is drawn, 0: there is none.
static int look(Trainer *trainer, Portrait *p, FsError *err)
{
    Scene now = {0};
    MUST(fs_photographer_down(trainer, err));
    MUST(fs_engine_scene_down(trainer->engine, 0, &now, err));
    direct(p, trainer, now.pane.normal);
    draw(p, trainer);
    return drawn(p);
}

// 1: found, 0: there is none.
static int search(Trainer *trainer, Portrait *p, FsError *err)
{
    double share = 0;
    int halvings = 0, round = PORTRAIT_VISITS * trainer->n_views, found = 1;
    while (trainer->long_edge >> halvings > PORTRAIT_SIDE) halvings++;
    fs_log_info(&trainer->project->log, "train: looks for the mirror image of who takes the photos");
    MUST(fs_views_load_halved(trainer, halvings, err));
    for (int r = 0; r < PORTRAIT_ROUNDS && found > 0; r++) {
        MUST(fs_photographer_up(trainer, err));
        MUST(steps(trainer, r * round, (r + 1) * round, err));
        found = look(trainer, p, err);
        if (found > 0 && r + 1 == PORTRAIT_ROUNDS) complete(p);
        if (found > 0 && (share = fill_all(trainer, p)) > PORTRAIT_MOST) found = 0;
    }
    if (found > 0)
        fs_log_info(&trainer->project->log, "train: who takes the photos is mirrored in %.0f %% of them", 100 * share);
    return found;
}

int fs_photographer_steps(const Settings *set, int photos)
{
    int round = PORTRAIT_VISITS * photos;
    bool pays = round <= PORTRAIT_SHARE * set->steps;
    return set->photographer && fs_train_cost_mirrors(set) && pays ? round : 0;
}

int fs_photographer_find(Trainer *trainer, FsError *err)
{
    const Settings *set = trainer->set;
    if (!set->photographer || !trainer->scene.pane_beta || !trainer->scene.cloud[LAYER_R].n) return 0;
    if (!fs_photographer_steps(set, trainer->n_views)) {
        fs_log_info(&trainer->project->log,
                    "train: does not look for the mirror image of who takes the photos: that wants %.0f steps",
                    ceil(PORTRAIT_VISITS * trainer->n_views / PORTRAIT_SHARE));
        return 0;
    }
    Portrait *p = calloc(1, sizeof *p);
    int rc = 0;
    trainer->occlusion = calloc((size_t)trainer->n_views, sizeof *trainer->occlusion);
    if (!p || !trainer->occlusion) TRY(fs_error_memory(err));
    for (int v = 0; v < trainer->n_views; v++)
        for (int i = 0; i < OCCLUSION_CELLS; i++) trainer->occlusion[v].cost[i] = OCCLUSION_COST;
    rc = search(trainer, p, err);
    if (rc == 0) {
        free(trainer->occlusion);
        trainer->occlusion = NULL;
    }
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
fail:
    free(p);
    return rc < 0 ? rc : 0;
}

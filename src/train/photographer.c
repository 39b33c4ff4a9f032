// The photographer's own mirror image: dark, unlit by the flash, and at another place of the mirrored room in each
// photo, so that it belongs to neither scene. Camera and mirror image move together, so all photos show that figure in
// the same directions; before the pane of a display case, around which people walk, in the same directions as seen
// along the way the photo looks. In these all photos learn one portrait: the share of the mirrored light that does not
// arrive (kernels/occlusion.h). A step shows the portrait to its photo and carries back what that photo changed. With
// all photos' say in each cell it is found before the mirrored scene has turned as dark as the figure. It has gaps,
// where there is nothing bright to hide: they are filled, and the figure goes on below. Within it the mirrored scene is
// left to those photos that see it clear.
//
// All this is looked for on small photos before training begins, from the same start: a capture without such a figure
// is trained as if nobody had looked.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "model/vertical.h"
#include "train/region.h"
#include "train/train_constants.h"
#include "train/trainer.h"

enum { PORTRAIT_CELLS = REGION_SIDE * REGION_SIDE };

// World: how a photo looks, on average; tangents of REACH to the sides.
typedef struct Axes {
    double ahead[3], right[3], up[3];
} Axes;

typedef struct Portrait {
    Axes *axes; // (n_views)
    float q[PORTRAIT_CELLS];
    bool seen[PORTRAIT_CELLS]; // by any photo
    Region figure, near;       // near: with some cells around it
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

// The part of a direction across the vertical; returns its length.
static double across_of(const double d[3], const double up[3], double level[3])
{
    double rise = v3_dot(d, up);
    for (int k = 0; k < 3; k++) level[k] = d[k] - rise * up[k];
    return v3_normalise(level);
}

// Where a photo looks, on the level: straight down, too, by which of its sides is the upper one.
static void facing(const Camera *camera, const double up[3], double front[3])
{
    const double *ahead = camera->w2c + 8, sign = v3_dot(ahead, up) < 0 ? -1 : 1;
    double d[3], lower[3];
    fs_vertical_lower(camera, up, lower);
    for (int k = 0; k < 3; k++) d[k] = ahead[k] + sign * lower[k];
    across_of(d, up, front);
}

// turned: all photos have axes of their own, turned about the vertical to where they look.
static void direct(Portrait *p, const Trainer *trainer, bool turned)
{
    double up[3], mean[3] = {0}, fronts[3] = {0}, front[3], level[3], across = 0;
    fs_vertical_find(trainer->views, trainer->n_views, up);
    for (int v = 0; v < trainer->n_views; v++) {
        const double *ahead = trainer->views[v]->camera.w2c + 8;
        facing(&trainer->views[v]->camera, up, front);
        across += across_of(ahead, up, level) / trainer->n_views;
        for (int k = 0; k < 3; k++) mean[k] += ahead[k] / trainer->n_views, fronts[k] += front[k];
    }
    if (!turned) across = across_of(mean, up, level);
    v3_normalise(fronts);
    for (int v = 0; v < trainer->n_views; v++) {
        Axes *a = &p->axes[v];
        memcpy(front, fronts, sizeof front);
        if (turned) facing(&trainer->views[v]->camera, up, front);
        for (int k = 0; k < 3; k++) a->ahead[k] = across * front[k] + v3_dot(mean, up) * up[k];
        v3_normalise(a->ahead);
        v3_cross(front, up, a->right);
        v3_normalise(a->right);
        v3_cross(a->right, a->ahead, a->up);
    }
}

static bool drawn(const Portrait *p)
{
    return memchr(p->figure.in, 1, sizeof p->figure.in) != NULL;
}

// last: whoever takes photos stands on the floor, and legs are dark before what is dark anyway: there is more below
// what was found. In a case they are upside down.
static void draw(Portrait *p, bool last, bool turned)
{
    const float outline = last ? PORTRAIT_SURE : PORTRAIT_OUTLINE;
    RegionRule rule = {outline, PORTRAIT_STANDS_OUT, PORTRAIT_GAP, PORTRAIT_LEAST, true};
    p->figure.width = p->figure.height = REGION_SIDE;
    fs_region_find(&p->figure, p->q, &rule);
    if (last) fs_region_complete(&p->figure, PORTRAIT_HEIGHT, turned);
    p->near = p->figure;
    fs_region_spread(&p->near, 1, PORTRAIT_NEAR);
    for (int i = 0; i < PORTRAIT_CELLS; i++)
        if (p->figure.in[i]) p->q[i] = 1;
}

// ---- back to the photos ----

// The cell of the portrait that a photo's cell shows; -1: it looks past it.
static int portrait_cell(const Axes *a, const Camera *c, int cell)
{
    double x = (cell % OCCLUSION_WIDTH + 0.5) / OCCLUSION_WIDTH, y = (cell / OCCLUSION_WIDTH + 0.5) / OCCLUSION_HEIGHT;
    const double ray[3] = {(x * c->width - c->cx) / c->fx, (y * c->height - c->cy) / c->fy, 1};
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = ray[0] * c->w2c[k] + ray[1] * c->w2c[4 + k] + ray[2] * c->w2c[8 + k];
    double z = PORTRAIT_REACH * v3_dot(d, a->ahead);
    double i = (v3_dot(d, a->right) / z + 1) / 2 * REGION_SIDE, j = (1 - v3_dot(d, a->up) / z) / 2 * REGION_SIDE;
    if (!(z > 0) || !(i >= 0) || !(i < REGION_SIDE) || !(j >= 0) || !(j < REGION_SIDE)) return -1;
    return (int)j * REGION_SIDE + (int)i;
}

// To a photo, for a step of the search.
static void show(const Portrait *p, const Trainer *trainer, int v)
{
    OcclusionState *state = &trainer->occlusion[v];
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        int at = portrait_cell(&p->axes[v], &trainer->views[v]->camera, i);
        state->q[i] = at < 0 ? 0 : p->q[at];
        state->cost[i] = at >= 0 && p->figure.in[at] ? -OCCLUSION_COST : OCCLUSION_COST;
    }
}

// What the step changed there.
static void carry_back(Portrait *p, const Trainer *trainer, int v)
{
    const OcclusionState *state = &trainer->occlusion[v];
    float change[PORTRAIT_CELLS] = {0}, n[PORTRAIT_CELLS] = {0};
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        int at = portrait_cell(&p->axes[v], &trainer->views[v]->camera, i);
        if (at < 0) continue;
        change[at] += state->q[i] - p->q[at];
        n[at]++;
    }
    for (int i = 0; i < PORTRAIT_CELLS; i++)
        if (n[i] > 0) p->seen[i] = true, p->q[i] = fminf(fmaxf(p->q[i] + PORTRAIT_RATE * change[i] / n[i], 0), 1);
}

// For training: how much of the photo the figure covers.
static double fill(const Portrait *p, const Trainer *trainer, int v)
{
    OcclusionState *state = &trainer->occlusion[v];
    double sum = 0;
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        int at = portrait_cell(&p->axes[v], &trainer->views[v]->camera, i);
        bool in = at >= 0 && p->figure.in[at], near = at >= 0 && p->near.in[at];
        state->q[i] = near ? p->q[at] : 0;
        state->cost[i] = in ? -PORTRAIT_PULL * OCCLUSION_COST : near ? OCCLUSION_COST : OCCLUSION_NEVER;
        sum += in;
    }
    return sum / OCCLUSION_CELLS;
}

static double fill_all(const Portrait *p, const Trainer *trainer)
{
    double share = 0;
    for (int v = 0; v < trainer->n_views; v++) share += fill(p, trainer, v) / trainer->n_views;
    return share;
}

// ---- the search ----

// DSSIM makes outlines stand out; what it does to the scenes' light (kernels/photometric.h) goes with them. What is
// behind shall not be guessed: as bright as what is around it, it would prove the figure.
static void weigh(double weight[LOSS_TERMS])
{
    double photo = weight[LOSS_L1] + weight[LOSS_DSSIM] + weight[LOSS_CONTRAST];
    weight[LOSS_L1] = (1 - PORTRAIT_DSSIM) * photo;
    weight[LOSS_DSSIM] = PORTRAIT_DSSIM * photo;
    weight[LOSS_CONTRAST] = weight[LOSS_UNSEEN] = 0;
}

static int steps(Trainer *trainer, Portrait *p, int from, int to, FsError *err)
{
    for (int step = from; step < to; step++) {
        StepArgs args;
        StepResult result;
        MUST(fs_pane_look_step(trainer, step, &args, err));
        weigh(args.weight);
        show(p, trainer, args.view);
        MUST(fs_engine_occlusion_up(trainer->engine, args.view, &trainer->occlusion[args.view], err));
        MUST(fs_engine_step(trainer->engine, &args, &result, err));
        MUST(fs_engine_occlusion_down(trainer->engine, args.view, &trainer->occlusion[args.view], err));
        carry_back(p, trainer, args.view);
    }
    return 0;
}

// From the start, so many steps with an empty portrait.
static int first_round(Trainer *trainer, Portrait *p, bool turned, FsError *err)
{
    memset(p->q, 0, sizeof p->q);
    memset(p->seen, 0, sizeof p->seen);
    memset(p->figure.in, 0, sizeof p->figure.in);
    direct(p, trainer, turned);
    MUST(fs_train_begin(trainer, err));
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
    MUST(fs_views_load_halved(trainer, fs_views_halvings(trainer->long_edge, PORTRAIT_SIDE), err));
    return steps(trainer, p, 0, PORTRAIT_VISITS * trainer->n_views, err);
}

// 1: found, 0: there is none.
static int search(Trainer *trainer, Portrait *p, FsError *err)
{
    double share = 0, turned_clarity;
    int round = PORTRAIT_VISITS * trainer->n_views;
    fs_log_info(&trainer->project->log, "train: looks for the mirror image of who takes the photos");
    MUST(first_round(trainer, p, true, err));
    turned_clarity = fs_region_clarity(p->q, p->seen);
    MUST(first_round(trainer, p, false, err));
    bool turned = turned_clarity > fs_region_clarity(p->q, p->seen);
    if (turned) MUST(first_round(trainer, p, true, err));
    for (int r = 1;; r++) {
        bool last = r == PORTRAIT_ROUNDS;
        draw(p, last, turned);
        if (!drawn(p) || (share = fill_all(p, trainer)) > PORTRAIT_MOST) return 0;
        if (last) break;
        MUST(steps(trainer, p, r * round, (r + 1) * round, err));
    }
    fs_log_info(&trainer->project->log, "train: who takes the photos is mirrored in %.0f %% of them", 100 * share);
    return 1;
}

int fs_photographer_steps(const Settings *set, int photos)
{
    int round = PORTRAIT_VISITS * photos;
    bool pays = round <= PORTRAIT_SHARE * set->steps;
    return set->photographer && fs_train_cost_mirrors(set) && pays ? 2 * round : 0; // turned, and not
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
    if (p) p->axes = calloc((size_t)trainer->n_views, sizeof *p->axes);
    if (!p || !p->axes || !trainer->occlusion) TRY(fs_error_memory(err));
    rc = search(trainer, p, err);
    if (rc == 0) {
        free(trainer->occlusion);
        trainer->occlusion = NULL;
    }
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
fail:
    if (p) free(p->axes);
    free(p);
    return rc < 0 ? rc : 0;
}

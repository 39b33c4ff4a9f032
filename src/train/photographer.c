// The photographer's own mirror image: dark, unlit by the flash, and at another place of the mirrored room in each
// photo, so that it belongs to neither scene. Camera and mirror image move together, so all photos show that figure in
// the same directions; before the pane of a display case, around which people walk, in the same directions as seen
// along the way the photo looks. In these all photos learn one portrait: the share of the mirrored light that does not
// arrive (kernels/occlusion.h). A step shows the portrait to its photo and carries back what that photo changed. With
// all photos' say in each cell it is found before the mirrored scene has turned as dark as the figure. It has gaps,
// where there is nothing bright to hide: they are filled, and the figure goes on below. Within it the mirrored scene is
// left to those photos that see it clear.
//
// What is dark and stands still in the mirrored room can look like such a figure while the mirrored scene is coarse.
// So the figure's portrait has to explain the photos better than one of things that stand still, which move in them
// as the room does.
//
// All this is looked for on small photos before training begins, from the same start: a capture without such a figure
// is trained as if nobody had looked.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "train/portrait_axes.h"
#include "train/train_constants.h"
#include "train/trainer.h"

typedef struct Portrait {
    PortraitKind kind;
    PortraitAxes *axes; // (n_views)
    double misfit;      // DSSIM, summed over the last quarter of a first round
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

static bool drawn(const Portrait *p)
{
    return memchr(p->figure.in, 1, sizeof p->figure.in) != NULL;
}

// last: whoever takes photos stands on the floor, and legs are dark before what is dark anyway: there is more below
// what was found. In a case they are upside down.
static void draw(Portrait *p, bool last)
{
    const float outline = last ? PORTRAIT_SURE : PORTRAIT_OUTLINE;
    RegionRule rule = {outline, PORTRAIT_STANDS_OUT, PORTRAIT_GAP, PORTRAIT_LEAST, true};
    p->figure.width = p->figure.height = REGION_SIDE;
    fs_region_find(&p->figure, p->q, &rule);
    if (last) fs_region_complete(&p->figure, PORTRAIT_HEIGHT, p->kind == PORTRAIT_TURNED);
    p->near = p->figure;
    fs_region_spread(&p->near, 1, PORTRAIT_NEAR);
    for (int i = 0; i < PORTRAIT_CELLS; i++)
        if (p->figure.in[i]) p->q[i] = 1;
}

// ---- back to the photos ----

// To a photo, for a step of the search.
static void show(const Portrait *p, const Trainer *trainer, int v)
{
    OcclusionState *state = &trainer->occlusion[v];
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        int at = fs_portrait_axes_cell(&p->axes[v], &trainer->views[v]->camera, i);
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
        int at = fs_portrait_axes_cell(&p->axes[v], &trainer->views[v]->camera, i);
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
        int at = fs_portrait_axes_cell(&p->axes[v], &trainer->views[v]->camera, i);
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
        p->misfit += (double)result.loss[LOSS_DSSIM];
    }
    return 0;
}

// From the start, so many steps with an empty portrait.
static int first_round(Trainer *trainer, Portrait *p, PortraitKind kind, FsError *err)
{
    const int all = PORTRAIT_VISITS * trainer->n_views, most = all - all / 4;
    memset(p->q, 0, sizeof p->q);
    memset(p->seen, 0, sizeof p->seen);
    memset(p->figure.in, 0, sizeof p->figure.in);
    p->kind = kind;
    fs_portrait_axes_direct(p->axes, kind, trainer->views, trainer->n_views);
    MUST(fs_train_begin(trainer, err));
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
    MUST(fs_views_load_halved(trainer, fs_views_halvings(trainer->long_edge, PORTRAIT_SIDE), err));
    MUST(steps(trainer, p, 0, most, err));
    p->misfit = 0;
    return steps(trainer, p, most, all, err);
}

// Whether photos are as well explained by a portrait of things that stand still; moving: the misfit of the found one.
static int stands_still(Trainer *trainer, Portrait *p, double moving, bool *still, FsError *err)
{
    Portrait *room = malloc(sizeof *room);
    if (!room) return fs_error_memory(err);
    *room = *p; // and the axes of both are the same memory
    int rc = first_round(trainer, room, PORTRAIT_STILL, err);
    *still = moving > (1 - PORTRAIT_MOVES) * room->misfit;
    free(room);
    fs_portrait_axes_direct(p->axes, p->kind, trainer->views, trainer->n_views);
    fill_all(p, trainer);
    return rc;
}

// 1: found, 0: there is none.
static int search(Trainer *trainer, Portrait *p, FsError *err)
{
    double share = 0, moving;
    int round = PORTRAIT_VISITS * trainer->n_views;
    bool still = false;
    fs_log_info(&trainer->project->log, "train: looks for the mirror image of who takes the photos");
    MUST(first_round(trainer, p, PORTRAIT_LEVEL, err));
    if (fs_portrait_axes_tilt(trainer->views, trainer->n_views) > PORTRAIT_TILT) {
        double level = fs_region_clarity(p->q, p->seen);
        MUST(first_round(trainer, p, PORTRAIT_TURNED, err));
        if (level >= fs_region_clarity(p->q, p->seen)) MUST(first_round(trainer, p, PORTRAIT_LEVEL, err));
    }
    moving = p->misfit;
    for (int r = 1;; r++) {
        bool last = r == PORTRAIT_ROUNDS;
        draw(p, last);
        if (!drawn(p) || (share = fill_all(p, trainer)) > PORTRAIT_MOST) return 0;
        if (last) break;
        MUST(steps(trainer, p, r * round, (r + 1) * round, err));
    }
    MUST(stands_still(trainer, p, moving, &still, err));
    if (still)
        fs_log_info(&trainer->project->log, "train: what looks like who takes the photos stands still: it is mirrored");
    else
        fs_log_info(&trainer->project->log, "train: who takes the photos is mirrored in %.0f %% of them", 100 * share);
    return !still;
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

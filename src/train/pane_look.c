// Before training begins, so many steps on small photos, from the start. What they show of the pane is kept, and
// training begins again from the same start: bars before the glass (bars.c), dirt on it (engine/dirt.h), which is on
// the pane and so tells its normal.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "engine/dirt.h"
#include "train/train_constants.h"
#include "train/trainer.h"

int fs_pane_look_step(Trainer *trainer, int step, StepArgs *args, FsError *err)
{
    if (fs_log_cancelled(&trainer->project->log))
        return fs_error_set(err, FS_ERR_CANCELLED, "stopped before step 1 of %d; run it again", trainer->set->steps);
    fs_schedule_step(trainer->set, &trainer->scene, step, args);
    args->learn = trainer->learn;
    args->view = fs_views_at_step(trainer, step);
    return 0;
}

static int steps(Trainer *trainer, int n, FsError *err)
{
    for (int step = 0; step < n; step++) {
        StepArgs args;
        StepResult result;
        MUST(fs_pane_look_step(trainer, step, &args, err));
        args.rate[CLOUD_COVERS] = RATE_COVERS;
        MUST(fs_engine_step(trainer->engine, &args, &result, err));
    }
    return 0;
}

// Evenly from all photos of each lighting. Returns how many. Their states are those of the look; training has its own.
static int load_small(const Trainer *trainer, DirtPhoto *photo, FsError *err)
{
    PhotoState *state = calloc((size_t)trainer->n_views, sizeof *state);
    int rc, halvings = fs_views_halvings(trainer->long_edge, DIRT_SIDE), n = 0, all[2] = {0, 0}, seen[2] = {0, 0};
    if (!state) TRY(fs_error_memory(err));
    TRY(fs_engine_photos_down(trainer->engine, state, err));
    for (int v = 0; v < trainer->n_views; v++) all[trainer->views[v]->flash]++;
    for (int v = 0; v < trainer->n_views; v++) {
        int of = trainer->views[v]->flash;
        if (!fs_order_is_some(seen[of]++, all[of], DIRT_PHOTOS)) continue;
        DirtPhoto *p = &photo[n++];
        p->view = trainer->views[v];
        p->state = state[v];
        TRY(fs_views_photo(trainer, v, halvings, &p->camera, &p->photo, &p->mask, err));
    }
    rc = n;
fail:
    free(state);
    return rc;
}

static int find_dirt(Trainer *trainer, const Scene *learned, FsError *err)
{
    Veil *veil = &trainer->scene.veil;
    DirtPhoto *photo = calloc((size_t)trainer->n_views, sizeof *photo);
    DirtArgs args = {trainer->engine, learned, trainer->threads, photo, 0};
    int rc, found;
    if (!photo) TRY(fs_error_memory(err));
    TRY(args.n = load_small(trainer, photo, err));
    TRY(found = fs_dirt_find(&args, veil, err));
    if (found) v3_cross(veil->right, veil->down, trainer->scene.pane.normal);
    if (found)
        fs_log_info(&trainer->project->log,
                    "train: found dirt on the glass, %.3g before the cameras (units of the poses)", veil->distance);
    else
        fs_log_info(&trainer->project->log, "train: found no dirt on the glass");
fail:
    for (int v = 0; photo && v < trainer->n_views; v++) {
        fs_image_free(&photo[v].photo);
        fs_image_free(&photo[v].mask);
    }
    free(photo);
    return rc < 0 ? rc : 0;
}

typedef struct Wanted {
    bool bars, dirt;
} Wanted;

static int learn(Trainer *trainer, bool covers, int n, Scene *learned, FsError *err)
{
    if (covers) MUST(fs_cloud_covers(&trainer->scene.cloud[LAYER_T_N], true, err));
    MUST(fs_train_begin(trainer, err));
    MUST(steps(trainer, n, err));
    return fs_engine_scene_down(trainer->engine, 1u << LAYER_T_N, learned, err);
}

// Once more, with what is near of R in T.
static int look_nearer(Trainer *trainer, int n, FsError *err)
{
    Scene learned = {0};
    BarsLoan loan = {{0}};
    int rc, lent;
    TRY(lent = fs_bars_loan_make(trainer, &loan, err));
    if (!lent) goto fail;
    TRY(learn(trainer, true, n, &learned, err));
    TRY(fs_bars_decide(trainer, &learned.cloud[LAYER_T_N], BARS_LENT, err));
    TRY(fs_bars_loan_settle(trainer, &loan, err));
fail:
    fs_scene_free(&learned);
    fs_bars_loan_free(&loan);
    return rc;
}

static void say_bars(const Trainer *trainer)
{
    const Cloud *T = &trainer->scene.cloud[LAYER_T_N];
    int covered = 0;
    for (int i = 0; T->width[CLOUD_COVERS] && i < T->n; i++) covered += T->field[CLOUD_COVERS][i] > 0;
    if (covered)
        fs_log_info(&trainer->project->log,
                    "train: found bars, where nothing is mirrored: %.0f %% of the Gaussians that T begins with",
                    100.0 * covered / T->n);
    else
        fs_log_info(&trainer->project->log, "train: found no bars");
}

static int look(Trainer *trainer, Wanted wanted, int n, FsError *err)
{
    Scene learned = {0};
    int rc;
    TRY(fs_views_load_halved(trainer, fs_pane_look_halvings(trainer->long_edge), err));
    TRY(learn(trainer, wanted.bars, n, &learned, err));
    if (wanted.bars) TRY(fs_bars_decide(trainer, &learned.cloud[LAYER_T_N], BARS_LEAST, err));
    if (wanted.dirt) TRY(find_dirt(trainer, &learned, err));
    if (wanted.bars) TRY(look_nearer(trainer, n, err));
    if (wanted.bars) say_bars(trainer);
fail:
    fs_scene_free(&learned);
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
    return rc < 0 ? rc : 0;
}

// Covers are rendered in the place of depth, and want a mirrored scene on a pane; dirt wants one that the flash lights.
static Wanted wanted_by(const Settings *set)
{
    bool may = fs_train_cost_mirrors(set);
    may &= strcmp(set->separation, "full") == 0 && strcmp(set->geometry, "shared") == 0;
    return (Wanted){.bars = may && set->bars && set->depth_smooth <= 0, .dirt = may && set->dirt};
}

int fs_pane_look_steps(const Settings *set)
{
    Wanted wanted = wanted_by(set);
    bool pays = PANE_STEPS <= PANE_SHARE * set->steps;
    return (wanted.bars || wanted.dirt) && pays ? PANE_STEPS : 0;
}

int fs_pane_look_halvings(int long_edge)
{
    return fs_views_halvings(long_edge, PANE_SIDE);
}

static bool enough_for_dirt(const Trainer *trainer)
{
    int n[2] = {0, 0};
    for (int v = 0; v < trainer->n_views; v++) n[trainer->views[v]->flash]++;
    return n[0] >= DIRT_FEWEST && n[1] >= DIRT_FEWEST;
}

int fs_pane_look(Trainer *trainer, FsError *err)
{
    const Settings *set = trainer->set;
    const Scene *scene = &trainer->scene;
    const Log *log = &trainer->project->log;
    Wanted wanted = wanted_by(set);
    int n = fs_pane_look_steps(set);
    bool may = scene->separation == SEPARATION_FULL && scene->shared_geometry && scene->pane_beta;
    if (!may || !scene->cloud[LAYER_R].n || scene->cloud[LAYER_T_N].n <= ENGINE_NEIGHBOURS) return 0;
    if (set->bars && !wanted.bars)
        fs_log_info(log, "train: does not look for bars before the glass: that wants no --depth-smooth");
    if (wanted.dirt && !enough_for_dirt(trainer)) {
        fs_log_info(log, "train: does not look for dirt on the glass: that wants %d photos with the flash and without",
                    DIRT_FEWEST);
        wanted.dirt = false;
    }
    if (!wanted.bars && !wanted.dirt) return 0;
    const char *what = !wanted.dirt   ? "bars before the glass"
                       : !wanted.bars ? "dirt on the glass"
                                      : "bars before the glass and dirt on it";
    if (!n)
        fs_log_info(log, "train: does not look for %s: that wants %.0f steps", what, ceil(PANE_STEPS / PANE_SHARE));
    else
        fs_log_info(log, "train: looks for %s", what);
    return n ? look(trainer, wanted, n, err) : 0;
}

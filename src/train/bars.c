// What stands before the pane or at it: the bars of a window, a frame. It is seen as it is and lit by the flash, so
// it is transmitted; but the mirrored scene, which the image equation adds everywhere, is missing there. Without
// saying so, the mirrored cloud grows something opaque in its place, of any colour that the photos leave open.
//
// So each transmitted Gaussian may have a cover, the share of the mirrored light that is missing before it
// (model/cloud.h), rendered like a colour. Free covers would take much that is dark in the mirrored scene. But learned
// quickly, on small photos, before training begins, they rise to 1 on bars, all along them, and nowhere else: what
// hangs together there is covered, for good, and training begins again from the same start. Where there is nothing of
// the kind clouds have no covers, and are trained as if nobody had looked.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "train/train_constants.h"
#include "train/trainer.h"

enum { K = ENGINE_NEIGHBOURS };

// ---- what was learned ----

// The mean over each Gaussian and its neighbours, several times. x (n); y: as much room.
static void even_out(float *x, float *y, const int *neighbour, int n)
{
    for (int round = 0; round < BARS_EVENED; round++) {
        memcpy(y, x, sizeof *y * (size_t)n);
        for (int i = 0; i < n; i++) {
            for (int k = 0; k < K; k++) x[i] += y[neighbour[i * K + k]];
            x[i] /= K + 1;
        }
    }
}

static int root_of(int *parent, int i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

// parent (n): of those above the edge, joined with their neighbours above it.
static void join(int *parent, const float *x, const int *neighbour, int n)
{
    for (int i = 0; i < n; i++) parent[i] = i;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < K && x[i] > BARS_EDGE; k++) {
            int j = neighbour[i * K + k];
            if (x[j] > BARS_EDGE) parent[root_of(parent, i)] = root_of(parent, j);
        }
}

// covers (n): 1 for each group with enough sure ones, else 0. Returns how many are 1.
static int decide(float *covers, const int *neighbour, int n, FsError *err)
{
    float *x = malloc(sizeof *x * 2 * (size_t)n);
    int *parent = malloc(sizeof *parent * (size_t)n), *sure = calloc((size_t)n, sizeof *sure), found = 0;
    if (!x || !parent || !sure) found = fs_error_memory(err);
    if (found == 0) {
        memcpy(x, covers, sizeof *x * (size_t)n);
        even_out(x, x + n, neighbour, n);
        join(parent, x, neighbour, n);
        for (int i = 0; i < n; i++) sure[root_of(parent, i)] += x[i] > BARS_SURE;
        for (int i = 0; i < n; i++) {
            covers[i] = x[i] > BARS_EDGE && sure[root_of(parent, i)] >= BARS_LEAST * n;
            found += covers[i] > 0;
        }
    }
    free(x);
    free(parent);
    free(sure);
    return found;
}

// ---- the look ----

static int steps(Trainer *trainer, int n, FsError *err)
{
    for (int step = 0; step < n; step++) {
        StepArgs args;
        StepResult result;
        if (fs_log_cancelled(&trainer->project->log))
            return fs_error_set(err, FS_ERR_CANCELLED, "stopped before step 1 of %d; run it again", trainer->set->steps);
        fs_schedule_step(trainer->set, &trainer->scene, step, &args);
        args.rate[CLOUD_COVERS] = RATE_COVERS;
        args.learn = trainer->learn;
        args.view = fs_views_at_step(trainer, step);
        MUST(fs_engine_step(trainer->engine, &args, &result, err));
    }
    return 0;
}

// What the start's covers become by training, on small photos.
static int learn(Trainer *trainer, int n, FsError *err)
{
    Scene learned = {0};
    Cloud *T = &trainer->scene.cloud[LAYER_T_N];
    int rc;
    TRY(fs_engine_scene_up(trainer->engine, &trainer->scene, err));
    if (trainer->neighbour) TRY(fs_engine_neighbours(trainer->engine, trainer->neighbour, err));
    TRY(fs_views_load_halved(trainer, fs_bars_halvings(trainer->long_edge), err));
    TRY(steps(trainer, n, err));
    TRY(fs_engine_scene_down(trainer->engine, 1u << LAYER_T_N, &learned, err));
    memcpy(T->field[CLOUD_COVERS], learned.cloud[LAYER_T_N].field[CLOUD_COVERS], sizeof(float) * (size_t)T->n);
fail:
    fs_scene_free(&learned);
    fs_engine_drop_views(trainer->engine);
    trainer->halvings = -1;
    return rc;
}

// Covers are rendered in the place of depth, and want a mirrored scene on a pane.
int fs_bars_steps(const Settings *set)
{
    bool pays = BARS_STEPS <= BARS_SHARE * set->steps, may = fs_train_cost_mirrors(set) && set->depth_smooth <= 0;
    may &= strcmp(set->separation, "full") == 0 && strcmp(set->geometry, "shared") == 0;
    return set->bars && may && pays ? BARS_STEPS : 0;
}

int fs_bars_halvings(int long_edge)
{
    int halvings = 0;
    while (long_edge >> halvings > BARS_SIDE) halvings++;
    return halvings;
}

int fs_bars_find(Trainer *trainer, FsError *err)
{
    const Scene *scene = &trainer->scene;
    Cloud *T = &trainer->scene.cloud[LAYER_T_N];
    int n = fs_bars_steps(trainer->set), found = 0, rc, *neighbour = NULL;
    bool may = scene->separation == SEPARATION_FULL && scene->shared_geometry && scene->pane_beta;
    if (!may || !scene->cloud[LAYER_R].n || T->n <= K) return 0;
    if (!n && trainer->set->bars)
        fs_log_info(&trainer->project->log, "train: does not look for bars before the glass: that wants %.0f steps%s",
                    ceil(BARS_STEPS / BARS_SHARE), trainer->set->depth_smooth > 0 ? ", and no --depth-smooth" : "");
    if (!n) return 0;
    fs_log_info(&trainer->project->log, "train: looks for bars before the glass");
    if (!(neighbour = malloc(sizeof *neighbour * K * (size_t)T->n))) TRY(fs_error_memory(err));
    rc = fs_knn(T->field[CLOUD_MEANS], T->n, K, neighbour, NULL, trainer->threads);
    if (rc < 0) TRY(fs_error_set(err, rc, "training: a Gaussian's position is not finite, or memory is out"));
    TRY(fs_cloud_covers(T, true, err));
    TRY(learn(trainer, n, err));
    TRY(found = decide(T->field[CLOUD_COVERS], neighbour, T->n, err));
    TRY(fs_cloud_covers(T, found > 0, err));
    if (found)
        fs_log_info(&trainer->project->log,
                    "train: found bars, where nothing is mirrored: %.0f %% of the Gaussians that T begins with",
                    100.0 * found / T->n);
    else
        fs_log_info(&trainer->project->log, "train: found no bars");
    rc = 0;
fail:
    free(neighbour);
    return rc;
}

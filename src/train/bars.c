// What stands before the pane or at it: the bars of a window, a frame. It is seen as it is and lit by the flash, so
// it is transmitted; but the mirrored scene, which the image equation adds everywhere, is missing there. Without
// saying so, the mirrored cloud grows something opaque in its place, of any colour that the photos leave open.
//
// So each transmitted Gaussian may have a cover, the share of the mirrored light that is missing before it
// (model/cloud.h), rendered like a colour. Free covers would take much that is dark in the mirrored scene. But learned
// quickly, on small photos, before training begins, they rise to 1 on bars, all along them, and nowhere else: what
// hangs together there is covered, for good, and training begins again from the same start, if it is nearer than what
// is seen around it, which is behind the glass: what is not is where the photographer hides the mirrored scene in all
// photos. Where there is nothing of the kind clouds have no covers, and are trained as if nobody had looked.
#include <stdlib.h>
#include <string.h>

#include "base/groups.h"
#include "base/knn.h"
#include "base/order.h"
#include "train/train_constants.h"
#include "train/trainer.h"

enum { K = ENGINE_NEIGHBOURS };

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

typedef struct Group { // by its root
    int sure, passed;  // Gaussians; of these in a view, so far
    int asked;         // of these, over the views
    double before;     // sum over those: the share of what is around them that is not behind
} Group;

typedef struct Sight { // of a Gaussian in a view
    float x, y, z;     // in widths of the photo; depth, 0: not in it
} Sight;

typedef struct Decision {
    const Trainer *trainer;
    const Cloud *T;
    float *x;     // (n) covers, evened out; as much room
    int *parent;  // (n) of the groups
    Group *group; // (n)
    double least; // share of the Gaussians that a group's sure ones are
    Sight *sight; // (n)
} Decision;

// Those above the edge, with their neighbours above it; how many of each group are sure.
static void join(Decision *d, const int *neighbour)
{
    for (int i = 0; i < d->T->n; i++) d->parent[i] = i;
    for (int i = 0; i < d->T->n; i++)
        for (int k = 0; k < K && d->x[i] > BARS_EDGE; k++) {
            int j = neighbour[i * K + k];
            if (d->x[j] > BARS_EDGE) fs_group_join(d->parent, j, i);
        }
    for (int i = 0; i < d->T->n; i++)
        if (d->x[i] > BARS_SURE) d->group[fs_group_of(d->parent, i)].sure++;
}

static void look_from(Decision *d, const Camera *camera)
{
    for (int i = 0; i < d->T->n; i++) {
        const float *p = d->T->field[CLOUD_MEANS] + 3 * (size_t)i;
        double px[2], z = fs_camera_sees(camera, (const double[3]){p[0], p[1], p[2]}, px);
        d->sight[i] = (Sight){0};
        if (z > 0) d->sight[i] = (Sight){(float)(px[0] / camera->width), (float)(px[1] / camera->width), (float)z};
    }
}

// Of what is not covered around a Gaussian, the share that is not behind it; -1: there is too little.
static double share_before(const Decision *d, int at)
{
    const Sight *of = &d->sight[at];
    int around = 0, before = 0;
    for (int i = 0; i < d->T->n; i++) {
        const Sight *s = &d->sight[i];
        float x = s->x - of->x, y = s->y - of->y;
        if (s->z <= 0 || d->x[i] > BARS_EDGE || x * x + y * y > BARS_AROUND * BARS_AROUND) continue;
        around++;
        before += s->z < BARS_BEHIND * of->z;
    }
    return around < BARS_SEEN ? -1 : (double)before / around;
}

static bool is_enough(const Decision *d, const Group *group)
{
    return group->sure >= d->least * d->T->n;
}

static void ask_view(Decision *d, const Camera *camera)
{
    look_from(d, camera);
    for (int i = 0; i < d->T->n; i++) {
        if (d->x[i] <= BARS_SURE || d->sight[i].z <= 0) continue;
        Group *g = &d->group[fs_group_of(d->parent, i)];
        if (!is_enough(d, g) || g->passed++ % (g->sure / BARS_ASKED + 1)) continue;
        double before = share_before(d, i);
        if (before < 0) continue;
        g->asked++;
        g->before += before;
    }
}

// covers (n): 1 for each group that is bars, else 0. Returns how many are 1.
static int decide(Decision *d, const int *neighbour, float *covers)
{
    const Trainer *trainer = d->trainer;
    const double before = trainer->scene.rare > 0 ? BARS_RARE : BARS_BEFORE;
    int found = 0, n = d->T->n;
    memcpy(d->x, covers, sizeof *covers * (size_t)n);
    even_out(d->x, d->x + n, neighbour, n);
    join(d, neighbour);
    for (int v = 0; v < trainer->n_views; v++)
        if (fs_order_is_some(v, trainer->n_views, BARS_VIEWS)) ask_view(d, &trainer->views[v]->camera);
    for (int i = 0; i < n; i++) {
        const Group *g = &d->group[fs_group_of(d->parent, i)];
        covers[i] = d->x[i] > BARS_EDGE && is_enough(d, g) && g->asked && g->before <= before * g->asked;
        found += covers[i] > 0;
    }
    if (found > BARS_MOST * n) { // the mirrored scene is not told well enough yet
        memset(covers, 0, sizeof *covers * (size_t)n);
        found = 0;
    }
    return found;
}

int fs_bars_decide(Trainer *trainer, const Cloud *learned, double least, FsError *err)
{
    Cloud *T = &trainer->scene.cloud[LAYER_T_N];
    size_t n = (size_t)T->n;
    int rc, *neighbour = malloc(sizeof *neighbour * K * n);
    Decision d = {.trainer = trainer,
                  .T = T,
                  .x = malloc(sizeof *d.x * 2 * n),
                  .parent = malloc(sizeof *d.parent * n),
                  .group = calloc(n, sizeof *d.group),
                  .sight = malloc(sizeof *d.sight * n),
                  .least = least};
    if (!neighbour || !d.x || !d.parent || !d.group || !d.sight) TRY(fs_error_memory(err));
    rc = fs_knn(T->field[CLOUD_MEANS], T->n, K, neighbour, NULL, trainer->threads);
    if (rc < 0) TRY(fs_error_set(err, rc, "training: a Gaussian's position is not finite, or memory is out"));
    memcpy(T->field[CLOUD_COVERS], learned->field[CLOUD_COVERS], sizeof(float) * n);
    int found = decide(&d, neighbour, T->field[CLOUD_COVERS]);
    TRY(fs_cloud_covers(T, found > 0, err));
    rc = found > 0;
fail:
    free(neighbour);
    free(d.x);
    free(d.parent);
    free(d.group);
    free(d.sight);
    return rc;
}

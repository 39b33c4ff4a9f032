// What stands before the pane or at it: the bars of a window, a frame. It is seen as it is and lit by the flash, so
// it is transmitted; but the mirrored scene, which the image equation adds everywhere, is missing there. Without
// saying so, the mirrored cloud grows something opaque in its place, of any colour that the photos leave open.
//
// So each transmitted Gaussian may have a cover, the share of the mirrored light that is missing before it
// (model/cloud.h), rendered like a colour. Free covers would take much that is dark in the mirrored scene. But learned
// quickly, on small photos, before training begins, they rise to 1 on bars, all along them, and nowhere else: what
// hangs together there is covered, for good, and training begins again from the same start, if it is nearer than what
// is behind the glass: farther away it is rather where the photographer hides the mirrored scene in all photos. Near
// ones stay only if photos are fitted better with them than by a portrait of the photographer alone (photographer.c).
// Where there is nothing of the kind clouds have no covers, and are trained as if nobody had looked.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/groups.h"
#include "base/knn.h"
#include "base/linalg.h"
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

// parent (n): of those above the edge, joined with their neighbours above it.
static void join(int *parent, const float *x, const int *neighbour, int n)
{
    for (int i = 0; i < n; i++) parent[i] = i;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < K && x[i] > BARS_EDGE; k++) {
            int j = neighbour[i * K + k];
            if (x[j] > BARS_EDGE) fs_group_join(parent, j, i);
        }
}

typedef struct Group { // by its root
    int sure;
    double farther; // sum over the sure ones: than T's mean, along the photos' mean direction
} Group;

// covers (n): 1 for each near group with enough sure ones, else 0. farther (n). Returns how many are 1.
static int groups(float *covers, const float *farther, const int *neighbour, int n, FsError *err)
{
    float *x = malloc(sizeof *x * 2 * (size_t)n);
    int *parent = malloc(sizeof *parent * (size_t)n), found = 0;
    Group *group = calloc((size_t)n, sizeof *group);
    if (!x || !parent || !group) found = fs_error_memory(err);
    if (found == 0) {
        memcpy(x, covers, sizeof *x * (size_t)n);
        even_out(x, x + n, neighbour, n);
        join(parent, x, neighbour, n);
        for (int i = 0; i < n; i++) {
            if (x[i] <= BARS_SURE) continue;
            Group *g = &group[fs_group_of(parent, i)];
            g->sure++;
            g->farther += (double)farther[i];
        }
        for (int i = 0; i < n; i++) {
            const Group *g = &group[fs_group_of(parent, i)];
            covers[i] = x[i] > BARS_EDGE && g->sure >= BARS_LEAST * n && g->farther < 0;
            found += covers[i] > 0;
        }
    }
    free(x);
    free(parent);
    free(group);
    return found;
}

// farther (n): how much farther than their mean T's Gaussians are, in the photos' mean direction, which is where the
// pane's normal begins.
static void distances(const Scene *scene, float *farther)
{
    const Cloud *T = &scene->cloud[LAYER_T_N];
    double mean = 0;
    for (int i = 0; i < T->n; i++) {
        const float *p = T->field[CLOUD_MEANS] + 3 * (size_t)i;
        double along = v3_dot((const double[3]){p[0], p[1], p[2]}, scene->pane.normal);
        farther[i] = (float)along;
        mean += along / T->n;
    }
    for (int i = 0; i < T->n; i++) farther[i] -= (float)mean;
}

// ---- for the look (pane_look.c) ----

int fs_bars_decide(Trainer *trainer, const Cloud *learned, FsError *err)
{
    Cloud *T = &trainer->scene.cloud[LAYER_T_N];
    int found = 0, rc, *neighbour = malloc(sizeof *neighbour * K * (size_t)T->n);
    float *farther = malloc(sizeof *farther * (size_t)T->n);
    if (!neighbour || !farther) TRY(fs_error_memory(err));
    rc = fs_knn(T->field[CLOUD_MEANS], T->n, K, neighbour, NULL, trainer->threads);
    if (rc < 0) TRY(fs_error_set(err, rc, "training: a Gaussian's position is not finite, or memory is out"));
    memcpy(T->field[CLOUD_COVERS], learned->field[CLOUD_COVERS], sizeof(float) * (size_t)T->n);
    distances(&trainer->scene, farther);
    TRY(found = groups(T->field[CLOUD_COVERS], farther, neighbour, T->n, err));
    TRY(fs_cloud_covers(T, found > 0, err));
    if (found)
        fs_log_info(&trainer->project->log,
                    "train: found bars, where nothing is mirrored: %.0f %% of the Gaussians that T begins with",
                    100.0 * found / T->n);
    else
        fs_log_info(&trainer->project->log, "train: found no bars");
    rc = 0;
fail:
    free(farther);
    free(neighbour);
    return rc;
}

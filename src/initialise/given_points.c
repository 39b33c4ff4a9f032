#include "initialise/given_points.h"

#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "initialise/constants.h"
#include "model/points_ply.h"

static bool is_seen(const SmallViews *views, const float xyz[3])
{
    double p[3] = {xyz[0], xyz[1], xyz[2]}, pixel[2];
    for (int i = 0; i < views->n; i++)
        if (fs_camera_sees(&views->view[i].camera, p, pixel) > 0) return true;
    return false;
}

int fs_given_points_read(const char *path, const SmallViews *views, SparsePoints *some, PointList *rest, FsError *err)
{
    int rc = 0, n, seen = 0;
    float *xyz;
    *rest = (PointList){0};
    MUST(fs_points_ply_read(path, &xyz, &n, err));
    for (int i = 0; i < n; i++)
        if (is_seen(views, xyz + 3 * (size_t)i))
            memmove(xyz + 3 * (size_t)seen++, xyz + 3 * (size_t)i, 3 * sizeof *xyz);
    if (n < INPUT_FEWEST) TRY(fs_error_input(err, "%s: only %d points, at least %d are needed", path, n, INPUT_FEWEST));
    if (seen < INPUT_FEWEST || seen < (int)(GIVEN_SEEN * (float)n))
        TRY(fs_error_input(err, "%s: the photos see %d of its %d points: it must be in the frame of the poses", path,
                           seen, n));
    int wanted = seen < GIVEN_CUES ? seen : GIVEN_CUES, taken = 0;
    TRY(fs_points_new(some, wanted, err));
    for (int i = 0; i < seen; i++) { // evenly out of the file's order
        const float *p = xyz + 3 * (size_t)i;
        if ((long long)i * wanted / seen == taken && taken < wanted)
            memcpy(some->xyz + 3 * (size_t)taken++, p, 3 * sizeof *p);
        else
            memmove(xyz + 3 * (size_t)rest->n++, p, 3 * sizeof *p);
    }
    rest->xyz = xyz;
    return 0;
fail:
    free(xyz);
    return rc;
}

typedef struct Split {
    const SparsePoints *some;
    const PointList *rest;
    const KnnTree *tree;
    unsigned char *kind; // (rest->n)
} Split;

static void split_job(void *context, int i, int worker)
{
    (void)worker;
    const Split *s = context;
    int index;
    float dist2;
    fs_knn_query(s->tree, s->rest->xyz + 3 * (size_t)i, -1, 1, &index, &dist2);
    s->kind[i] = s->some->kind[index];
}

int fs_given_points_split(const SparsePoints *some, const PointList *rest, Threads *threads, PointList dense[2],
                          FsError *err)
{
    int rc = 0;
    unsigned char *kind = malloc((size_t)rest->n + 1);
    KnnTree *tree = fs_knn_new(some->xyz, some->n);
    for (int k = 0; k < 2; k++) dense[k] = (PointList){.xyz = malloc(sizeof(float) * 3 * ((size_t)rest->n + 1))};
    if (!kind || !tree || !dense[0].xyz || !dense[1].xyz) TRY(fs_error_memory(err));
    fs_threads_for(threads, rest->n, split_job, &(Split){some, rest, tree, kind});
    for (int i = 0; i < rest->n; i++) {
        if (kind[i] == POINT_UNSURE) continue;
        PointList *to = &dense[kind[i] == POINT_REFLECTED];
        memcpy(to->xyz + 3 * (size_t)to->n++, rest->xyz + 3 * (size_t)i, 3 * sizeof(float));
    }
fail:
    fs_knn_free(tree);
    free(kind);
    return rc;
}

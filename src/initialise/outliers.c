#include "initialise/outliers.h"

#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "initialise/constants.h"

typedef struct Filter {
    const PointList *dense;
    const KnnTree *own, *other;
    float farther;
    unsigned char *drop; // (dense->n)
} Filter;

static void filter_job(void *context, int i, int worker)
{
    (void)worker;
    const Filter *v = context;
    const float *p = v->dense->xyz + 3 * (size_t)i;
    int index;
    float own2, other2;
    fs_knn_query(v->own, p, -1, 1, &index, &own2);
    fs_knn_query(v->other, p, -1, 1, &index, &other2);
    v->drop[i] = own2 > v->farther * v->farther * other2;
}

static KnnTree *tree_of(const SparsePoints *points, PointKind wanted, float *some, int *count)
{
    *count = 0;
    for (int i = 0; i < points->n; i++)
        if (points->kind[i] == wanted)
            memcpy(some + 3 * (size_t)(*count)++, points->xyz + 3 * (size_t)i, sizeof(float) * 3);
    return *count ? fs_knn_new(some, *count) : NULL;
}

int fs_outliers_drop(const SparsePoints *points, bool reflected, Threads *threads, PointList *dense, FsError *err)
{
    float *some = malloc(sizeof(float) * 3 * ((size_t)points->n + 1));
    unsigned char *drop = malloc((size_t)dense->n + 1);
    KnnTree *tree[2] = {NULL, NULL};
    int rc = 0, count[2] = {0}, kept = 0;
    if (!some || !drop) TRY(fs_error_memory(err));
    for (int k = 0; k < 2; k++) {
        tree[k] = tree_of(points, k ? POINT_REFLECTED : POINT_TRANSMITTED, some, &count[k]);
        if (count[k] && !tree[k]) TRY(fs_error_memory(err));
    }
    if (!tree[0] || !tree[1]) goto fail;
    Filter filter = {dense, tree[reflected], tree[!reflected], reflected ? OUTLIERS_FARTHER_R : OUTLIERS_FARTHER_T,
                     drop};
    fs_threads_for(threads, dense->n, filter_job, &filter);
    for (int i = 0; i < dense->n; i++)
        if (!drop[i]) memmove(dense->xyz + 3 * (size_t)kept++, dense->xyz + 3 * (size_t)i, sizeof(float) * 3);
    dense->n = kept;
fail:
    fs_knn_free(tree[0]);
    fs_knn_free(tree[1]);
    free(some);
    free(drop);
    return rc;
}

// ---- mirrored seeds before the transmitted surface ----

typedef struct Before {
    const SmallViews *views;
    const Seeds *seeds;
    const KnnTree *direction; // of the surface's points in the middle view: x / z, y / z, 0
    const float *depth;       // log z of these
    unsigned char *before;
} Before;

static void before_job(void *context, int i, int worker)
{
    (void)worker;
    const Before *w = context;
    float uvl[3], dist2[BEFORE_NEIGHBOURS];
    int index[BEFORE_NEIGHBOURS], farther = 0;
    w->before[i] = 0;
    if (!fs_small_views_direction(w->views, w->seeds->xyz + 3 * (size_t)i, uvl)) return;
    fs_knn_query(w->direction, (float[3]){uvl[0], uvl[1], 0}, -1, BEFORE_NEIGHBOURS, index, dist2);
    for (int k = 0; k < BEFORE_NEIGHBOURS; k++) farther += index[k] >= 0 && w->depth[index[k]] > uvl[2];
    w->before[i] = farther >= BEFORE_FARTHER;
}

int fs_outliers_before(const SmallViews *views, const PointList *surface, const Seeds *seeds, Threads *threads,
                       unsigned char *before, FsError *err)
{
    size_t size = (size_t)surface->n + 1;
    float *place = calloc(3 * size, sizeof *place), *depth = malloc(sizeof *depth * size), uvl[3];
    KnnTree *tree = NULL;
    int rc = 0, n = 0, count = 0;
    memset(before, 0, (size_t)seeds->n);
    if (!place || !depth) TRY(fs_error_memory(err));
    for (int i = 0; i < surface->n; i++) {
        if (!fs_small_views_direction(views, surface->xyz + 3 * (size_t)i, uvl)) continue;
        memcpy(place + 3 * (size_t)n, uvl, sizeof(float) * 2);
        depth[n++] = uvl[2];
    }
    if (n < BEFORE_NEIGHBOURS) goto fail;
    tree = fs_knn_new(place, n);
    if (!tree) TRY(fs_error_memory(err));
    Before work = {views, seeds, tree, depth, before};
    fs_threads_for(threads, seeds->n, before_job, &work);
    for (int i = 0; i < seeds->n; i++) count += before[i];
    if ((float)count > BEFORE_MOST * (float)seeds->n) memset(before, 0, (size_t)seeds->n);
fail:
    fs_knn_free(tree);
    free(place);
    free(depth);
    return rc;
}

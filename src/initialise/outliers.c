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
    Filter vet = {dense, tree[reflected], tree[!reflected], reflected ? OUTLIERS_FARTHER_R : OUTLIERS_FARTHER_T, drop};
    fs_threads_for(threads, dense->n, filter_job, &vet);
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

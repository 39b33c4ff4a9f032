// A balanced k-d tree over a permutation of the points: a node is a range, its two children are the range's halves
// around the median of its longest side; ranges of up to LEAF points are searched through.
#include "base/knn.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "base/error.h"

#define LEAF 8
#define DEPTH_MAX 32 // enough for 2^31 points: the halves of a range differ by one at most

typedef struct KnnPoint {
    float p[3];
    int index;
} KnnPoint;

typedef struct KnnNode {
    int axis; // -1: leaf
    float split;
    int right; // node of the upper half; the lower half's is the next one
} KnnNode;

struct KnnTree {
    int n, n_nodes;
    KnnPoint *point;
    KnnNode *node;
};

static bool before(const KnnPoint *a, const KnnPoint *b, int axis)
{
    return a->p[axis] < b->p[axis] || (a->p[axis] == b->p[axis] && a->index < b->index);
}

static void swap_points(KnnPoint *a, KnnPoint *b)
{
    KnnPoint t = *a;
    *a = *b;
    *b = t;
}

// Puts the element that belongs at `mid` of the sorted range there, smaller ones before it, larger ones after it.
static void select_median(KnnPoint *point, int lo, int hi, int mid, int axis)
{
    while (hi - lo > 1) {
        int a = lo, b = lo + (hi - lo) / 2, c = hi - 1; // median of three to the front
        if (before(&point[b], &point[a], axis)) a = b, b = lo;
        int m = before(&point[c], &point[a], axis) ? a : before(&point[c], &point[b], axis) ? c : b;
        swap_points(&point[lo], &point[m]);
        KnnPoint pivot = point[lo];
        int i = lo, j = hi;
        for (;;) {
            while (++i < hi && before(&point[i], &pivot, axis)) {
            }
            while (before(&pivot, &point[--j], axis)) {
            }
            if (i >= j) break;
            swap_points(&point[i], &point[j]);
        }
        swap_points(&point[lo], &point[j]);
        if (j == mid) return;
        if (j < mid)
            lo = j + 1;
        else
            hi = j;
    }
}

static int longest_axis(const KnnPoint *point, int lo, int hi)
{
    float best = -1;
    int axis = 0;
    for (int a = 0; a < 3; a++) {
        float min = INFINITY, max = -INFINITY;
        for (int i = lo; i < hi; i++) {
            min = fminf(min, point[i].p[a]);
            max = fmaxf(max, point[i].p[a]);
        }
        if (max - min > best) {
            best = max - min;
            axis = a;
        }
    }
    return axis;
}

static void build(KnnTree *tree, int lo, int hi)
{
    int self = tree->n_nodes++;
    if (hi - lo <= LEAF) {
        tree->node[self] = (KnnNode){-1, 0, 0};
        return;
    }
    int axis = longest_axis(tree->point, lo, hi), mid = lo + (hi - lo) / 2;
    select_median(tree->point, lo, hi, mid, axis);
    tree->node[self].axis = axis;
    tree->node[self].split = tree->point[mid].p[axis];
    build(tree, lo, mid);
    tree->node[self].right = tree->n_nodes;
    build(tree, mid, hi);
}

KnnTree *fs_knn_new(const float *xyz, int n)
{
    for (size_t i = 0; i < 3 * (size_t)n; i++)
        if (!isfinite(xyz[i])) return NULL;
    KnnTree *tree = calloc(1, sizeof *tree);
    if (!tree) return NULL;
    tree->n = n;
    tree->point = malloc(sizeof *tree->point * ((size_t)n + 1));
    tree->node = malloc(sizeof *tree->node * ((size_t)n + 2));
    if (!tree->point || !tree->node) {
        fs_knn_free(tree);
        return NULL;
    }
    for (int i = 0; i < n; i++) {
        const float *p = xyz + 3 * (size_t)i;
        tree->point[i] = (KnnPoint){{p[0], p[1], p[2]}, i};
    }
    build(tree, 0, n);
    return tree;
}

void fs_knn_free(KnnTree *tree)
{
    if (!tree) return;
    free(tree->point);
    free(tree->node);
    free(tree);
}

typedef struct Nearest { // found so far
    int k, *index;
    float *dist2;
} Nearest;

static void insert(const Nearest *nearest, int i, float d)
{
    int at = nearest->k - 1, *index = nearest->index;
    float *dist2 = nearest->dist2;
    if (d > dist2[at] || (d == dist2[at] && index[at] >= 0 && i > index[at])) return;
    for (; at > 0 && (d < dist2[at - 1] || (d == dist2[at - 1] && i < index[at - 1])); at--) {
        dist2[at] = dist2[at - 1];
        index[at] = index[at - 1];
    }
    dist2[at] = d;
    index[at] = i;
}

static void search_leaf(const KnnTree *tree, int lo, int hi, const float q[3], int skip, const Nearest *nearest)
{
    for (int i = lo; i < hi; i++) {
        const KnnPoint *p = &tree->point[i];
        float x = p->p[0] - q[0], y = p->p[1] - q[1], z = p->p[2] - q[2];
        float d = x * x + y * y + z * z;
        if (p->index != skip && d < INFINITY) insert(nearest, p->index, d);
    }
}

typedef struct Pending { // a node to search in, and its range
    int node, lo, hi;
    float near2; // no point of the range is nearer than this along one axis
} Pending;

void fs_knn_query(const KnnTree *tree, const float q[3], int skip, int k, int *index, float *dist2)
{
    Pending stack[DEPTH_MAX + 2];
    for (int i = 0; i < k; i++) {
        index[i] = -1;
        dist2[i] = INFINITY;
    }
    if (k <= 0) return;
    int top = 0;
    stack[top++] = (Pending){0, 0, tree->n, 0};
    while (top > 0) {
        Pending now = stack[--top];
        int node = now.node, lo = now.lo, hi = now.hi;
        if (now.near2 > dist2[k - 1]) continue;
        while (tree->node[node].axis >= 0) {
            const KnnNode *at = &tree->node[node];
            int mid = lo + (hi - lo) / 2;
            float d = q[at->axis] - at->split;
            Pending lower = {node + 1, lo, mid, d * d}, upper = {at->right, mid, hi, d * d};
            stack[top++] = d < 0 ? upper : lower;
            Pending near = d < 0 ? lower : upper;
            node = near.node, lo = near.lo, hi = near.hi;
        }
        search_leaf(tree, lo, hi, q, skip, &(Nearest){k, index, dist2});
    }
}

typedef struct KnnWork {
    const KnnTree *tree;
    const float *xyz;
    int k;
    int *index;
    float *dist2, *scratch;
} KnnWork;

static void knn_job(void *context, int i, int worker)
{
    KnnWork *w = context;
    size_t at = (size_t)i * (size_t)w->k;
    float *dist2 = w->dist2 ? w->dist2 + at : w->scratch + (size_t)worker * (size_t)w->k;
    fs_knn_query(w->tree, w->xyz + 3 * (size_t)i, i, w->k, w->index + at, dist2);
}

int fs_knn(const float *xyz, int n, int k, int *index, float *dist2, Threads *threads)
{
    if (n <= 0 || k <= 0) return 0;
    for (size_t i = 0; i < 3 * (size_t)n; i++)
        if (!isfinite(xyz[i])) return FS_ERR_NUMERIC;
    KnnTree *tree = fs_knn_new(xyz, n);
    float *scratch = malloc(sizeof *scratch * (size_t)k * (size_t)fs_threads_count(threads));
    int rc = tree && scratch ? 0 : FS_ERR_MEMORY;
    if (rc == 0) {
        KnnWork work = {tree, xyz, k, index, dist2, scratch};
        fs_threads_for(threads, n, knn_job, &work);
    }
    free(scratch);
    fs_knn_free(tree);
    return rc;
}

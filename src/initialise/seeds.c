#include "initialise/seeds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/knn.h"
#include "base/linalg.h"
#include "base/rng.h"
#include "image/fill.h"
#include "initialise/constants.h"

void fs_seeds_free(Seeds *seeds)
{
    free(seeds->xyz);
    free(seeds->scale);
    *seeds = (Seeds){0};
}

static bool project_cell(const Camera *camera, const float xyz[3], int width, int height, size_t *cell, float *inverse)
{
    double p[3] = {xyz[0], xyz[1], xyz[2]}, pixel[2];
    double z = fs_camera_sees(camera, p, pixel);
    if (!(z > 0)) return false;
    int x = (int)(pixel[0] / camera->width * width), y = (int)(pixel[1] / camera->height * height);
    if (x >= width || y >= height) return false; // rounded up
    *cell = (size_t)y * (size_t)width + (size_t)x;
    *inverse = (float)(1 / z);
    return true;
}

// Inverse depth (height, width) of a view at a fraction of its size, from points; *any: false when none is in view.
// Where several points share a pixel the nearest count.
static int depth_of(const SmallView *view, const PointList *points, int width, int height, float *inverse_depth,
                    bool *any, FsError *err)
{
    size_t n = (size_t)width * (size_t)height, cell;
    float *weight = calloc(n, sizeof(float)), *nearest = calloc(n, sizeof(float)), inverse;
    int rc = 0;
    if (!weight || !nearest) TRY(fs_error_memory(err));
    memset(inverse_depth, 0, sizeof(float) * n);
    for (int i = 0; i < points->n; i++)
        if (project_cell(&view->camera, points->xyz + 3 * (size_t)i, width, height, &cell, &inverse))
            nearest[cell] = fmaxf(nearest[cell], inverse);
    for (int i = 0; i < points->n; i++) {
        if (!project_cell(&view->camera, points->xyz + 3 * (size_t)i, width, height, &cell, &inverse)) continue;
        if (inverse < (1 - SURFACE_SAME) * nearest[cell]) continue;
        inverse_depth[cell] += inverse;
        weight[cell] += 1;
    }
    TRY(fs_fill_holes(inverse_depth, weight, width, height, 1, any, err));
fail:
    free(weight);
    free(nearest);
    return rc;
}

static void append(Seeds *seeds, const float xyz[3])
{
    memcpy(seeds->xyz + 3 * (size_t)seeds->n++, xyz, sizeof(float) * 3);
}

int fs_seeds_order(const SmallViews *views, int *order, FsError *err)
{
    double *nearest = malloc(sizeof *nearest * ((size_t)views->n + 1)); // squared, to those chosen; -1: chosen itself
    if (!nearest) return fs_error_memory(err);
    for (int i = 0; i < views->n; i++) nearest[i] = INFINITY;
    for (int k = 0; k < views->n; k++) {
        int best = -1;
        double best_d = 0;
        for (int i = 0; i < views->n; i++) {
            if (nearest[i] < 0) continue;
            double d = k ? nearest[i] : -v3_distance2(views->view[i].centre, views->centre);
            if (best >= 0 && d <= best_d) continue;
            best = i;
            best_d = d;
        }
        order[k] = best;
        for (int i = 0; i < views->n; i++)
            nearest[i] = fmin(nearest[i], v3_distance2(views->view[i].centre, views->view[best].centre));
        nearest[best] = -1;
    }
    free(nearest);
    return 0;
}

// One view's surface: a seed in each cell that no seed covers yet. Stops at the count.
static int cover_view(const SmallView *view, const PointList *points, float cell_px, int count, Rng *rng, Seeds *seeds,
                      FsError *err)
{
    int rc = 0;
    bool any = false;
    int width = (int)ceilf((float)view->camera.width / cell_px),
        height = (int)ceilf((float)view->camera.height / cell_px);
    size_t n = (size_t)width * (size_t)height, cell;
    float *surface = malloc(sizeof(float) * n), inverse;
    unsigned char *covered = calloc(n, 1);
    if (!surface || !covered) TRY(fs_error_memory(err));
    TRY(depth_of(view, points, width, height, surface, &any, err));
    for (int i = 0; i < seeds->n; i++)
        if (project_cell(&view->camera, seeds->xyz + 3 * (size_t)i, width, height, &cell, &inverse) &&
            fabsf(inverse - surface[cell]) < SEEDS_COVERED * surface[cell])
            covered[cell] = 1;
    for (size_t i = 0; i < n && any; i++) {
        float u = fs_rng_uniform(rng), v = fs_rng_uniform(rng), xyz[3];
        if (covered[i] || !(surface[i] > 0) || seeds->n >= count) continue;
        double x = ((double)(i % (size_t)width) + (double)u) * view->camera.width / width;
        double y = ((double)(i / (size_t)width) + (double)v) * view->camera.height / height;
        fs_small_views_unproject(&view->camera, x, y, 1 / (double)surface[i], xyz);
        append(seeds, xyz);
    }
fail:
    free(surface);
    free(covered);
    return rc;
}

// The smallest cells with which all views are covered within the count.
static int cover_all(const SmallViews *views, const PointList *points, int count, uint64_t seed, Seeds *seeds,
                     FsError *err)
{
    int rc = 0, before = seeds->n, n = points->n - points->alone;
    int stride = (n + SEEDS_SURFACE_POINTS - 1) / SEEDS_SURFACE_POINTS;
    if (count <= before || n <= 0) return 0;
    int *order = malloc(sizeof(int) * (size_t)views->n);
    PointList some = {.xyz = malloc(sizeof(float) * 3 * (size_t)(n / stride + 1))};
    if (!order || !some.xyz) TRY(fs_error_memory(err));
    for (int i = 0; i < n; i += stride)
        memcpy(some.xyz + 3 * (size_t)some.n++, points->xyz + 3 * (size_t)i, sizeof(float) * 3);
    TRY(fs_seeds_order(views, order, err));
    const Camera *middle = &views->view[order[0]].camera;
    float cell_px =
        fmaxf(sqrtf((float)middle->width * (float)middle->height / (float)(count - before)), SEEDS_CELL_MIN_PX);
    for (int attempt = 0; attempt < SEEDS_ATTEMPTS; attempt++) {
        Rng rng = fs_rng_new(seed);
        seeds->n = before;
        for (int k = 0; k < views->n && seeds->n < count; k++)
            TRY(cover_view(&views->view[order[k]], &some, cell_px, count, &rng, seeds, err));
        if (seeds->n < count) break;
        cell_px *= SEEDS_CELL_GROWTH;
    }
fail:
    free(order);
    free(some.xyz);
    return rc;
}

static int neighbours_of(const float *xyz, int n, int k, int *index, float *dist2, Threads *threads, FsError *err)
{
    int rc = index && dist2 ? fs_knn(xyz, n, k, index, dist2, threads) : FS_ERR_MEMORY;
    if (rc == FS_ERR_MEMORY) return fs_error_memory(err);
    return rc < 0 ? fs_error_set(err, rc, "the start: a point is too far away to be placed; run the poses stage again")
                  : 0;
}

// Copies of the points, moved by a share of the distance to their neighbours.
static int add_copies(const PointList *points, int count, Rng *rng, Threads *threads, Seeds *seeds, FsError *err)
{
    enum { K = 3 };
    int *index = malloc(sizeof(int) * K * (size_t)points->n);
    float *dist2 = malloc(sizeof(float) * K * (size_t)points->n);
    int rc = 0;
    TRY(neighbours_of(points->xyz, points->n, K, index, dist2, threads, err));
    while (seeds->n < count) {
        int i = fs_rng_below(rng, points->n);
        float sum = 0, step, xyz[3];
        for (int k = 0; k < K; k++) sum += isfinite(dist2[K * i + k]) ? sqrtf(dist2[K * i + k]) / K : 0;
        step = SEEDS_COPY_STEP * sum;
        for (int k = 0; k < 3; k++)
            xyz[k] = points->xyz[3 * (size_t)i + (size_t)k] + step * fs_rng_normal(rng) * 0.57735f;
        append(seeds, xyz);
    }
fail:
    free(index);
    free(dist2);
    return rc;
}

static int measure_scales(const SmallViews *views, Threads *threads, Seeds *seeds, FsError *err)
{
    enum { K = 3 };
    int *index = malloc(sizeof(int) * K * (size_t)seeds->n);
    float *dist2 = malloc(sizeof(float) * K * (size_t)seeds->n);
    int rc = 0;
    TRY(neighbours_of(seeds->xyz, seeds->n, K, index, dist2, threads, err));
    double side = views->n ? fmax(views->view[0].camera.width, views->view[0].camera.height) : 300;
    for (int i = 0; i < seeds->n; i++) {
        const float *p = seeds->xyz + 3 * (size_t)i;
        double d2 = v3_distance2((double[3]){p[0], p[1], p[2]}, views->centre), mean = 0;
        for (int k = 0; k < K; k++) mean += isfinite(dist2[K * i + k]) ? sqrt((double)dist2[K * i + k]) / K : 0;
        double pixel = fmax(sqrt(d2), 1e-6) / views->focal_px;
        seeds->scale[i] = (float)fmin(fmax(mean, pixel / SEEDS_LEAST), pixel * side / SEEDS_MOST);
    }
fail:
    free(index);
    free(dist2);
    return rc;
}

int fs_seeds_make(const SmallViews *views, const PointList *points, int count, uint64_t seed, Threads *threads,
                  Seeds *seeds, FsError *err)
{
    int rc = 0;
    *seeds = (Seeds){0};
    seeds->xyz = malloc(sizeof(float) * 3 * (size_t)count);
    seeds->scale = malloc(sizeof(float) * (size_t)count);
    if (!seeds->xyz || !seeds->scale) TRY(fs_error_memory(err));
    Rng rng = fs_rng_new(seed);
    int most = (int)(SEEDS_POINT_SHARE * (float)count), wanted = points->n < most ? points->n : most;
    for (int i = 0; i < points->n; i++) // as many as wanted, each as likely (Knuth's algorithm S)
        if (fs_rng_below(&rng, points->n - i) < wanted - seeds->n) append(seeds, points->xyz + 3 * (size_t)i);
    int surface = (int)(SEEDS_SURFACE_SHARE * (float)(count - seeds->n));
    seeds->n_points = seeds->n;
    TRY(cover_all(views, points, seeds->n + surface, seed + 1, seeds, err));
    TRY(add_copies(points, count, &rng, threads, seeds, err));
    TRY(measure_scales(views, threads, seeds, err));
    return 0;
fail:
    fs_seeds_free(seeds);
    return rc;
}

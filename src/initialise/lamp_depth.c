#include "initialise/lamp_depth.h"

#include <math.h>
#include <stdlib.h>

#include "base/order.h"
#include "initialise/constants.h"

typedef struct Search {
    const SmallViews *views;
    const PointList *const *dense;
    int (*count)[2]; // per view: pixels that were judged, of these before the room
    bool *failed;    // per view: out of memory
} Search;

// Depth of the nearest points of a scene but for a few, in a view; 0: too few are seen.
static double nearest(const SmallView *view, const PointList *points, float *depth)
{
    size_t n = 0;
    for (int i = 0; i < points->n; i++) {
        const float *p = points->xyz + 3 * (size_t)i;
        double pixel[2], z = fs_camera_sees(&view->camera, (const double[3]){p[0], p[1], p[2]}, pixel);
        if (z > 0) depth[n++] = (float)z;
    }
    if (n < LAMP_POINTS) return 0;
    fs_order_floats(depth, n);
    return (double)depth[(size_t)(LAMP_NEAREST * (double)n)];
}

// Whether a pixel's light at that depth is clipped in the other photos without the flash: the share of those that see
// the place; 0 where too few do.
static double agreement(const SmallViews *views, const SmallView *view, int pixel, double z)
{
    int seen = 0, clipped = 0, width = view->camera.width;
    float at[3];
    fs_small_views_unproject(&view->camera, pixel % width + 0.5, (double)(pixel / width) + 0.5, z, at);
    for (int i = 0; i < views->n; i++) {
        const SmallView *other = &views->view[i];
        double there[2];
        if (other == view || other->flash || !fs_order_is_some(i, views->n, LAMP_OTHERS)) continue;
        if (!(fs_camera_sees(&other->camera, (const double[3]){at[0], at[1], at[2]}, there) > 0)) continue;
        seen++;
        clipped += other->clipped[(size_t)there[1] * (size_t)other->camera.width + (size_t)there[0]];
    }
    return seen < LAMP_VIEWS ? 0 : (double)clipped / seen;
}

static void judge_pixel(const Search *s, int v, int pixel, double nearest_T, double nearest_R)
{
    double best[2] = {0, 0}; // before the room, in it
    for (int k = 0; k < LAMP_DEPTHS; k++) {
        double inverse = (k + 0.5) / LAMP_DEPTHS / (LAMP_NEARER * nearest_T);
        bool room = inverse * nearest_R < LAMP_MARGIN;
        best[room] = fmax(best[room], agreement(s->views, &s->views->view[v], pixel, 1 / inverse));
    }
    if (fmax(best[0], best[1]) < LAMP_AGREE) return;
    s->count[v][0]++;
    s->count[v][1] += best[0] > best[1] + LAMP_BETTER;
}

static void judge_view(void *context, int v, int worker)
{
    (void)worker;
    const Search *s = context;
    const SmallView *view = &s->views->view[v];
    int n = view->camera.width * view->camera.height, clipped = 0;
    int most = s->dense[0]->n > s->dense[1]->n ? s->dense[0]->n : s->dense[1]->n;
    for (int i = 0; i < n; i++) clipped += view->clipped[i];
    if (view->flash || !clipped) return;
    float *depth = malloc(((size_t)most + 1) * sizeof *depth);
    s->failed[v] = !depth;
    if (!depth) return;
    double T = nearest(view, s->dense[0], depth), R = nearest(view, s->dense[1], depth);
    free(depth);
    for (int i = 0, k = 0; i < n && T > 0 && R > 0; i++)
        if (view->clipped[i] && fs_order_is_some(k++, clipped, LAMP_PIXELS)) judge_pixel(s, v, i, T, R);
}

int fs_lamp_depth_behind(const SmallViews *views, const PointList *const dense[2], Threads *threads, double *behind,
                         FsError *err)
{
    size_t n = (size_t)views->n;
    Search s = {views, dense, calloc(n + 1, sizeof *s.count), calloc(n + 1, sizeof *s.failed)};
    int rc = 0, judged = 0, before = 0;
    bool failed = !s.count || !s.failed;
    *behind = 0;
    if (!failed) fs_threads_for(threads, views->n, judge_view, &s);
    for (int v = 0; v < views->n && !failed; v++) {
        failed = s.failed[v];
        judged += s.count[v][0];
        before += s.count[v][1];
    }
    if (failed) TRY(fs_error_memory(err));
    if (judged >= LAMP_FEWEST) *behind = (double)before / judged;
fail:
    free(s.count);
    free(s.failed);
    return rc;
}

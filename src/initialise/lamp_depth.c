#include "initialise/lamp_depth.h"

#include <math.h>
#include <stdlib.h>

#include "base/order.h"
#include "initialise/constants.h"

typedef struct Found { // of a view
    int judged, n;
    float place[LAMP_PIXELS][3]; // (n) behind the pane
    bool failed;                 // out of memory
} Found;

typedef struct Search {
    const SmallViews *views;
    const PointList *const *dense;
    Found *found; // per view
} Search;

// Where a view sees the two scenes: by cells of the picture and the depths that are tried, how many points lie there.
typedef struct Crowd {
    const SmallView *view;
    int wide, high; // cells
    double step;    // of the depths, inverse
    double room;    // depth at which the mirrored room begins
    float *n[2];    // (high, wide, LAMP_DEPTHS) share of all points that are seen
} Crowd;

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

static void fill_crowd(Crowd *c, const PointList *points, float *n)
{
    int seen = 0;
    for (int i = 0; i < points->n; i++) {
        const float *p = points->xyz + 3 * (size_t)i;
        double pixel[2], z = fs_camera_sees(&c->view->camera, (const double[3]){p[0], p[1], p[2]}, pixel);
        if (!(z > 0)) continue;
        seen++;
        if (1 / z / c->step >= LAMP_DEPTHS) continue;
        int x = (int)pixel[0] / LAMP_CELL, y = (int)pixel[1] / LAMP_CELL;
        n[(y * c->wide + x) * LAMP_DEPTHS + (int)(1 / z / c->step)]++;
    }
    for (int i = 0; i < c->high * c->wide * LAMP_DEPTHS && seen; i++) n[i] /= (float)seen;
}

// Of the points of a scene those around a pixel, about as far away as that depth.
static double crowd_at(const Crowd *c, int scene, int pixel, int depth)
{
    int width = c->view->camera.width, x = pixel % width / LAMP_CELL, y = pixel / width / LAMP_CELL;
    double sum = 0;
    for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < c->high; v++)
        for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < c->wide; u++)
            for (int k = depth > 0 ? depth - 1 : 0; k <= depth + 1 && k < LAMP_DEPTHS; k++)
                sum += (double)c->n[scene][(v * c->wide + u) * LAMP_DEPTHS + k];
    return sum;
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

// Depth of a lamp behind the pane; 0: it is mirrored, or nothing tells. Of the depths at which the photos agree best,
// the scene that has more points there has the lamp; where neither has any, it is behind the pane if they agree less
// from where the room begins.
static double depth_behind(const Search *s, const Crowd *c, int pixel, bool *judged)
{
    double agree[LAMP_DEPTHS], best[2] = {0, 0}, beside[2] = {0, 0}; // before the room, in it; points of either scene
    int at[2] = {0, 0};                                              // best before the room; where most points are
    for (int k = 0; k < LAMP_DEPTHS; k++) {
        double z = 1 / ((k + 0.5) * c->step);
        bool room = z * LAMP_MARGIN > c->room;
        agree[k] = agreement(s->views, c->view, pixel, z);
        if (!room && agree[k] > best[room]) at[0] = k;
        best[room] = fmax(best[room], agree[k]);
    }
    double most = fmax(best[0], best[1]), crowd = 0;
    *judged = most >= LAMP_AGREE;
    for (int k = 0; k < LAMP_DEPTHS && *judged; k++) {
        if (agree[k] <= most - LAMP_BETTER) continue;
        double here = crowd_at(c, 0, pixel, k);
        beside[0] += here;
        beside[1] += crowd_at(c, 1, pixel, k);
        if (here > crowd) at[1] = k;
        crowd = fmax(crowd, here);
    }
    bool alone = beside[0] + beside[1] <= 0, behind = alone ? best[0] > best[1] + LAMP_BETTER : beside[0] > beside[1];
    return *judged && behind ? 1 / ((at[!alone] + 0.5) * c->step) : 0;
}

static void judge_pixel(const Search *s, const Crowd *c, int pixel, Found *found)
{
    bool judged;
    int width = c->view->camera.width;
    double z = depth_behind(s, c, pixel, &judged);
    found->judged += judged;
    if (z > 0)
        fs_small_views_unproject(&c->view->camera, pixel % width + 0.5, (double)(pixel / width) + 0.5, z,
                                 found->place[found->n++]);
}

static void judge_view(void *context, int v, int worker)
{
    (void)worker;
    const Search *s = context;
    const SmallView *view = &s->views->view[v];
    int width = view->camera.width, n = width * view->camera.height, clipped = 0;
    size_t most = (size_t)(s->dense[0]->n > s->dense[1]->n ? s->dense[0]->n : s->dense[1]->n) + 1;
    for (int i = 0; i < n; i++) clipped += view->clipped[i];
    if (view->flash || !clipped) return;
    Crowd c = {.view = view, .wide = width / LAMP_CELL + 1, .high = view->camera.height / LAMP_CELL + 1};
    size_t cells = (size_t)(c.wide * c.high) * LAMP_DEPTHS;
    float *scratch = calloc(2 * cells + most, sizeof *scratch);
    s->found[v].failed = !scratch;
    if (!scratch) return;
    double T = nearest(view, s->dense[0], scratch + 2 * cells);
    c.room = nearest(view, s->dense[1], scratch + 2 * cells);
    if (T > 0 && c.room > 0) {
        c.step = 1 / (LAMP_DEPTHS * LAMP_NEARER * T);
        for (int i = 0; i < 2; i++) {
            c.n[i] = scratch + (size_t)i * cells;
            fill_crowd(&c, s->dense[i], c.n[i]);
        }
        for (int i = 0, k = 0; i < n; i++)
            if (view->clipped[i] && fs_order_is_some(k++, clipped, LAMP_PIXELS)) judge_pixel(s, &c, i, &s->found[v]);
    }
    free(scratch);
}

int fs_lamp_depth_find(const SmallViews *views, const PointList *const dense[2], Threads *threads, PointList *behind,
                       int *judged, FsError *err)
{
    Search s = {views, dense, calloc((size_t)views->n + 1, sizeof *s.found)};
    int rc = 0;
    *behind = (PointList){0};
    *judged = 0;
    if (!s.found) return fs_error_memory(err);
    fs_threads_for(threads, views->n, judge_view, &s);
    for (int v = 0; v < views->n; v++) {
        if (s.found[v].failed) TRY(fs_error_memory(err));
        *judged += s.found[v].judged;
        for (int i = 0; i < s.found[v].n; i++) TRY(fs_points_append(behind, s.found[v].place[i], err));
    }
fail:
    free(s.found);
    if (rc < 0) fs_points_list_free(behind);
    return rc;
}

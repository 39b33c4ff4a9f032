#include "initialise/start.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"
#include "initialise/constants.h"

static RadianceShape shape_of(Separation separation, const SmallViews *views)
{
    const Camera *camera = &views->view[0].camera;
    return fs_radiance_shape(separation == SEPARATION_FULL, separation != SEPARATION_NONE,
                             fs_camera_longer_side(camera));
}

enum { PARTS = 200, FEWEST_OF_KIND = 10 };

static double disparity_of(const RadianceFrame *f, double z)
{
    return fmin(fmax((1 - f->near / z) / (1 - f->near / f->far), 0), 1);
}

static double depth_of(const Start *start, int i)
{
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = (double)start->points->xyz[3 * (size_t)i + (size_t)k] - start->views->centre[k];
    return v3_dot(d, start->views->forward);
}

// The disparity that parts points, by depth, into two kinds that each are most alike (Otsu 1979).
static double part_depths(const RadianceFrame *f, const float *z, int n)
{
    double sum = 0, before = 0, best = -1, parts = 0.5, last = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n; i++) {
            double s = disparity_of(f, (double)z[i]);
            if (!pass) {
                sum += s;
                continue;
            }
            double apart = i ? sum / n * i - before : 0, between = i ? apart * apart / ((double)i * (n - i)) : 0;
            if (between > best && s > last) best = between, parts = (last + s) / 2;
            before += s;
            last = s;
        }
    return fmin(fmax(parts, 0.05), 0.95);
}

// The disparity with the least of T's points beyond it and of R's before it, by the flash cue.
static void part_kinds(const Start *start, const RadianceFrame *f, double *parts)
{
    const SparsePoints *p = start->points;
    int n[POINT_REFLECTED + 1] = {0};
    for (int i = 0; i < p->n; i++) n[p->kind[i]]++;
    if (n[POINT_TRANSMITTED] < FEWEST_OF_KIND || n[POINT_REFLECTED] < FEWEST_OF_KIND) return;
    double best = 1e30;
    int first = 0;
    for (int k = 1; k < PARTS; k++) {
        double s = (double)k / PARTS, wrong = 0;
        for (int i = 0; i < p->n; i++) {
            double at = disparity_of(f, depth_of(start, i));
            if (p->kind[i] == POINT_TRANSMITTED) wrong += (at > s) / (double)n[POINT_TRANSMITTED];
            if (p->kind[i] == POINT_REFLECTED) wrong += (at <= s) / (double)n[POINT_REFLECTED];
        }
        if (wrong < best - 1e-12) best = wrong, first = k;
        if (wrong < best + 1e-12) *parts = 0.5 * (first + k) / PARTS; // the middle of those as good
    }
}

// Nearest and farthest depth along the middle direction of view, of nearly all points.
static int find_depths(const Start *start, RadianceFrame *frame, FsError *err)
{
    const SparsePoints *points = start->points;
    float *z = malloc(sizeof *z * ((size_t)points->n + 1));
    int n = 0;
    if (!z) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) {
        z[n] = (float)depth_of(start, i);
        n += z[n] > 0;
    }
    fs_order_floats(z, (size_t)n);
    frame->near = n ? FIELD_NEARER * (double)z[(int)(FIELD_POINTS_OUT * n)] : 0;
    frame->far = n ? FIELD_FARTHER * (double)z[(int)((1 - FIELD_POINTS_OUT) * (n - 1))] : 0;
    if (n && frame->near > 0) frame->parts = part_depths(frame, z, n);
    free(z);
    if (n && frame->near > 0) return 0;
    return fs_error_set(err, FS_ERR_INPUT,
                        "initialise: no points before the photos; run the poses stage again (--force)");
}

// All that the photos' corners see between the depths.
static void find_range(const SmallViews *v, RadianceFrame *f)
{
    for (int k = 0; k < 2; k++) f->low[k] = 1e5, f->high[k] = -1e5;
    for (int i = 0; i < v->n; i++)
        for (int corner = 0; corner < 8; corner++) {
            const Camera *c = &v->view[i].camera;
            float xyz[3];
            fs_small_views_unproject(c, corner & 1 ? c->width : 0, corner & 2 ? c->height : 0,
                                     corner & 4 ? f->near : f->far, xyz);
            double at[3];
            for (int r = 0; r < 3; r++)
                at[r] = f->w2c[4 * r] * (double)xyz[0] + f->w2c[4 * r + 1] * (double)xyz[1] +
                        f->w2c[4 * r + 2] * (double)xyz[2] + f->w2c[4 * r + 3];
            double z = fmax(at[2], 0.5 * f->near);
            for (int k = 0; k < 2; k++) {
                f->low[k] = fmin(f->low[k], at[k] / z);
                f->high[k] = fmax(f->high[k], at[k] / z);
            }
        }
}

int fs_first_field_make(const Start *start, const Settings *set, Scene *scene, FsError *err)
{
    const SmallViews *v = start->views;
    *scene = (Scene){.separation = fs_scene_separation(set->separation),
                     .shared_geometry = true,
                     .extent = 1.1 * v->extent,
                     .gain_color = {1, 1, 1},
                     .flash_distance = 1};
    RadianceFrame frame = {0};
    const double *axis[3] = {v->right, v->down, v->forward};
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) frame.w2c[4 * r + k] = axis[r][k];
        frame.w2c[4 * r + 3] = -v3_dot(axis[r], v->centre);
    }
    MUST(find_depths(start, &frame, err));
    if (scene->separation == SEPARATION_FULL) part_kinds(start, &frame, &frame.parts);
    find_range(v, &frame);
    RadianceShape shape = shape_of(scene->separation, v);
    fs_log_info(start->log, "initialise: fields from %.3g to %.3g units of depth, parted at %.3g, %.1f million numbers",
                frame.near, frame.far, frame.near / (1 - frame.parts * (1 - frame.near / frame.far)),
                (double)fs_radiance_floats(&shape) / 1e6);
    return fs_radiance_new(&scene->field, &shape, &frame, start->seed, err);
}

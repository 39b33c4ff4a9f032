#include "initialise/rear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/rng.h"

typedef struct Sample {
    int n, left;      // the first `left` are on no plane yet
    double (*ray)[3]; // (n) x / z, y / z, 1 in the middle view
    double *inverse;  // (n) depth
} Sample;

// b with row[i] . b = value[i]; false where there is none.
static bool solve(const double row[3][3], const double value[3], double b[3])
{
    double cross[3][3], det;
    for (int i = 0; i < 3; i++) v3_cross(row[(i + 1) % 3], row[(i + 2) % 3], cross[i]);
    det = v3_dot(row[0], cross[0]);
    for (int k = 0; k < 3; k++) b[k] = (value[0] * cross[0][k] + value[1] * cross[1][k] + value[2] * cross[2][k]) / det;
    return isfinite(b[0] + b[1] + b[2]);
}

// How much nearer than a plane a point is, relative, in inverse depth.
static double before(const Sample *s, int i, const double plane[3])
{
    return 1 - v3_dot(plane, s->ray[i]) / s->inverse[i];
}

// Share of the points on a plane, those that are on no other; less what lies behind it.
static double score(const Sample *s, const double plane[3])
{
    int on = 0, behind = 0;
    for (int i = 0; i < s->n; i++) {
        double d = before(s, i, plane);
        on += i < s->left && fabs(d) < REAR_SAME;
        behind += d < -2 * REAR_SAME;
    }
    return (on - REAR_BEHIND * behind) / s->n;
}

// Least squares over the points on the plane.
static void refine(const Sample *s, double plane[3])
{
    for (int round = 0; round < REAR_ROUNDS; round++) {
        double row[3][3] = {{0}}, value[3] = {0}, better[3];
        for (int i = 0; i < s->left; i++) {
            if (fabs(before(s, i, plane)) >= REAR_SAME) continue;
            for (int j = 0; j < 3; j++) {
                double w = s->ray[i][j] / s->inverse[i];
                for (int k = 0; k < 3; k++) row[j][k] += w * s->ray[i][k] / s->inverse[i];
                value[j] += w;
            }
        }
        if (!solve(row, value, better)) return;
        memcpy(plane, better, sizeof better);
    }
}

static void swap(Sample *s, int i, int j)
{
    double ray[3], inverse = s->inverse[i];
    memcpy(ray, s->ray[i], sizeof ray);
    memcpy(s->ray[i], s->ray[j], sizeof ray);
    memcpy(s->ray[j], ray, sizeof ray);
    s->inverse[i] = s->inverse[j];
    s->inverse[j] = inverse;
}

// The best of many planes through three points. Its points are on no other from then on.
static bool find_plane(Sample *s, Rng *rng, double plane[3])
{
    double best = REAR_LEAST;
    bool found = false;
    for (int trial = 0; trial < REAR_TRIALS && s->left >= 3; trial++) {
        double row[3][3], value[3], b[3];
        for (int k = 0; k < 3; k++) {
            int i = fs_rng_below(rng, s->left), j = fs_rng_below(rng, s->left);
            if (s->inverse[j] < s->inverse[i]) i = j; // the farther one: what is behind all is looked for
            memcpy(row[k], s->ray[i], sizeof row[k]);
            value[k] = s->inverse[i];
        }
        if (!solve(row, value, b)) continue;
        double of = score(s, b);
        if (of <= best) continue;
        best = of;
        found = true;
        memcpy(plane, b, sizeof b);
    }
    if (!found) return false;
    refine(s, plane);
    for (int i = 0; i < s->left;)
        if (fabs(before(s, i, plane)) < 2 * REAR_SAME)
            swap(s, i, --s->left);
        else
            i++;
    return true;
}

int fs_rear_find(const SmallViews *views, const PointList *points, uint64_t seed, Rear *rear, FsError *err)
{
    int stride = (points->n + REAR_POINTS - 1) / REAR_POINTS, rc = 0;
    Sample s = {.ray = malloc(sizeof *s.ray * (REAR_POINTS + 1)),
                .inverse = malloc(sizeof(double) * (REAR_POINTS + 1))};
    Rng rng = fs_rng_new(seed);
    *rear = (Rear){0};
    if (!s.ray || !s.inverse) TRY(fs_error_memory(err));
    for (int i = 0; i < points->n; i += stride) {
        float uvl[3];
        if (!fs_small_views_direction(views, points->xyz + 3 * (size_t)i, uvl)) continue;
        memcpy(s.ray[s.n], (double[3]){uvl[0], uvl[1], 1}, sizeof *s.ray);
        s.inverse[s.n++] = exp(-(double)uvl[2]);
    }
    s.left = s.n;
    while (s.n >= REAR_FEWEST && rear->n < REAR_PLANES && find_plane(&s, &rng, rear->plane[rear->n])) rear->n++;
fail:
    free(s.ray);
    free(s.inverse);
    return rc;
}

// How many times as far as a place the rear behind it is; 0 where there is none behind it.
static double farther(const SmallViews *views, const Rear *rear, const float xyz[3])
{
    float uvl[3];
    double inverse = 0;
    if (!fs_small_views_direction(views, xyz, uvl)) return 0;
    for (int k = 0; k < rear->n; k++) inverse = fmax(inverse, v3_dot(rear->plane[k], (double[3]){uvl[0], uvl[1], 1}));
    double times = 1 / (inverse * exp((double)uvl[2]));
    return times > 1 + SURFACE_SAME && times < REAR_MOST ? times : 0;
}

static float *grow(Arena *arena, const float *values, int n, int more, int each)
{
    float *grown = ARENA_NEW(arena, float, (size_t)(n + more) * (size_t)each);
    if (grown) memcpy(grown, values, sizeof *values * (size_t)n * (size_t)each);
    return grown;
}

int fs_rear_add(const SmallViews *views, const Rear *rear, ColoredSeeds *p, FsError *err)
{
    Seeds *T = &p->T;
    int n = T->n, more = n - T->n_points;
    float *xyz = realloc(T->xyz, sizeof(float) * 3 * (size_t)(n + more + 1));
    if (xyz) T->xyz = xyz;
    float *scale = realloc(T->scale, sizeof(float) * (size_t)(n + more + 1));
    if (scale) T->scale = scale;
    p->T_N = grow(&p->arena, p->T_N, n, more, 3);
    p->T_F = grow(&p->arena, p->T_F, n, more, 3);
    p->gain = grow(&p->arena, p->gain, n, more, 1);
    if (!xyz || !scale || p->arena.failed) return fs_error_memory(err);
    for (int i = T->n_points; i < n; i++) {
        float times = (float)farther(views, rear, xyz + 3 * (size_t)i);
        size_t from = (size_t)i, to = (size_t)T->n;
        if (!(times > 0)) continue;
        for (size_t k = 0; k < 3; k++) {
            float centre = (float)views->centre[k];
            xyz[3 * to + k] = centre + times * (xyz[3 * from + k] - centre);
            p->T_N[3 * to + k] = p->T_N[3 * from + k];
            p->T_F[3 * to + k] = p->T_F[3 * from + k];
        }
        scale[to] = times * scale[from];
        p->gain[to] = p->gain[from];
        T->n++;
    }
    return 0;
}

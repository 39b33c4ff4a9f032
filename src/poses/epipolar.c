// The two centres and a feature's ray span a plane; it meets the other photo in the epipolar line. All planes contain
// the baseline, so each is one angle about it: features of the other photo, sorted by their planes' angles, give the
// few near a line by bisection.
#include "poses/epipolar.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "poses/match.h"

typedef struct Pair { // how to get from the first camera's frame to the second's
    double r[9], t[3];
    double axis[2][3]; // perpendicular to t and each other
    double roll;       // turn of the picture about the optical axis
    float reach;       // largest difference of angles within the tolerance
} Pair;

// False when the centres coincide.
static bool relate(const Camera *a, const Camera *b, Pair *pair)
{
    fs_camera_relative(a, b, pair->r, pair->t);
    double length = sqrt(v3_dot(pair->t, pair->t)), unit[3], other[3] = {0, 0, 0};
    if (!(length > 1e-12)) return false;
    int smallest = 0;
    for (int i = 0; i < 3; i++) {
        unit[i] = pair->t[i] / length;
        if (fabs(unit[i]) < fabs(unit[smallest])) smallest = i;
    }
    other[smallest] = 1;
    v3_cross(unit, other, pair->axis[0]);
    v3_normalise(pair->axis[0]);
    v3_cross(unit, pair->axis[0], pair->axis[1]);
    pair->roll = atan2(pair->r[3] - pair->r[1], pair->r[0] + pair->r[4]);
    return true;
}

static float plane_angle(const Pair *pair, const double ray[3])
{
    return (float)atan2(v3_dot(ray, pair->axis[1]), v3_dot(ray, pair->axis[0]));
}

// Features of b by their plane's angle, once more at both ends so that no range wraps round. Returns their number.
static int sort_planes(const SearchPhoto *b, Pair *pair, double tolerance, Ranked *sorted)
{
    const double least_sine = 0.05; // nearer to the epipole depth cannot be told
    double sine_min = 1, length = sqrt(v3_dot(pair->t, pair->t));
    int n = 0, nb = b->features->n;
    for (int j = 0; j < nb; j++) {
        double ray[3] = {b->ray[2 * j], b->ray[2 * j + 1], 1}, normal[3];
        v3_cross(ray, pair->t, normal);
        double sine = sqrt(v3_dot(normal, normal) / v3_dot(ray, ray)) / length;
        if (!(sine > least_sine)) continue;
        if (sine < sine_min) sine_min = sine;
        sorted[n++] = (Ranked){plane_angle(pair, ray), j};
    }
    fs_order_ranked(sorted, (size_t)n);
    pair->reach = (float)fmin(1.2 * tolerance / sine_min, 1.5);
    memcpy(sorted + n, sorted, (size_t)n * sizeof *sorted);
    memcpy(sorted + 2 * n, sorted, (size_t)n * sizeof *sorted);
    for (int j = 0; j < n; j++) {
        sorted[j].by = (float)sorted[j].by - 6.28318531f;
        sorted[2 * n + j].by = (float)sorted[2 * n + j].by + 6.28318531f;
    }
    return 3 * n;
}

static int first_from(const Ranked *sorted, int n, float angle)
{
    int lo = 0, hi = n;
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (sorted[mid].by < angle)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

static bool alike_shape(const Features *fa, int i, const Features *fb, int j, double roll)
{
    float ratio = fa->scale[i] / fb->scale[j];
    double turn = remainder(fb->angle[j] - fa->angle[i] - roll, 2 * M_PI);
    return ratio > 0.4f && ratio < 2.5f && fabs(turn) < 0.7;
}

typedef struct Found {
    Candidate candidate;
    int dot;
} Found;

// Keeps the best few at different places, best first.
static void keep(Found *found, int *n, const Features *fb, Found next)
{
    const float near_px = 2.5f;
    int at = *n;
    for (int k = 0; k < *n; k++) {
        float dx = fb->xy[2 * found[k].candidate.feature] - fb->xy[2 * next.candidate.feature];
        float dy = fb->xy[2 * found[k].candidate.feature + 1] - fb->xy[2 * next.candidate.feature + 1];
        if (dx * dx + dy * dy > near_px * near_px) continue;
        if (found[k].dot >= next.dot) return;
        memmove(found + k, found + k + 1, (size_t)(*n - k - 1) * sizeof *found);
        --*n;
        k--;
    }
    for (at = *n; at > 0 && found[at - 1].dot < next.dot; at--)
        if (at <= FS_EPIPOLAR_CANDIDATES) found[at] = found[at - 1];
    if (at <= FS_EPIPOLAR_CANDIDATES) {
        found[at] = next;
        if (*n <= FS_EPIPOLAR_CANDIDATES) ++*n;
    }
}

typedef struct Search { // for a's features among b's
    const SearchPhoto *a, *b;
    Pair pair;
    const Ranked *sorted;
    int n_sorted;
    double max_inverse_z;
    const TriangulateOptions *options;
} Search;

static void search_one(const Search *search, int i, Candidates *out)
{
    const SearchPhoto *a = search->a, *b = search->b;
    const Pair *pair = &search->pair;
    const Ranked *sorted = search->sorted;
    const TriangulateOptions *o = search->options;
    const double ray[3] = {a->ray[2 * i], a->ray[2 * i + 1], 1}, *t = pair->t, fx = b->camera->fx, fy = b->camera->fy;
    double far_ray[3], line[3];
    for (int k = 0; k < 3; k++) far_ray[k] = v3_dot(pair->r + 3 * k, ray);
    v3_cross(t, far_ray, line);
    double norm = sqrt(line[0] * line[0] / (fx * fx) + line[1] * line[1] / (fy * fy));
    out->n = 0;
    if (!(norm > 0)) return;
    float angle = plane_angle(pair, far_ray);
    int least = (int)((1 - 0.5 * o->max_distance * o->max_distance) * 512 * 512), n = 0;
    Found found[FS_EPIPOLAR_CANDIDATES + 2];
    for (int s = first_from(sorted, search->n_sorted, angle - pair->reach);
         s < search->n_sorted && sorted[s].by <= angle + pair->reach; s++) {
        int j = sorted[s].index;
        double u = b->ray[2 * j], v = b->ray[2 * j + 1];
        if (fabs(line[0] * u + line[1] * v + line[2]) > o->tolerance_px * norm) continue;
        double au = far_ray[0] - u * far_ray[2], bu = u * t[2] - t[0]; // au = bu * inverse_z, likewise in y
        double av = far_ray[1] - v * far_ray[2], bv = v * t[2] - t[1];
        double steep = bu * bu + bv * bv, inverse_z = steep > 0 ? (au * bu + av * bv) / steep : -1;
        double slack = 2 / (fx * sqrt(steep > 0 ? steep : 1)); // two pixels beyond infinity are noise
        if (!(inverse_z > -slack) || inverse_z > search->max_inverse_z) continue;
        if (!alike_shape(a->features, i, b->features, j, pair->roll)) continue;
        int dot = fs_match_dot(a->features->descriptor + (size_t)i * FS_DESCRIPTOR,
                               b->features->descriptor + (size_t)j * FS_DESCRIPTOR);
        if (dot < least) continue;
        keep(found, &n, b->features, (Found){{j, (float)fmax(inverse_z, 0)}, dot});
    }
    if (n == 0) return;
    float best = fs_match_distance(found[0].dot);
    for (int k = 0; k < n && k < FS_EPIPOLAR_CANDIDATES; k++) { // those that the best does not clearly beat
        if (k > 0 && best < o->max_ratio * fs_match_distance(found[k].dot)) break;
        out->candidate[out->n++] = found[k].candidate;
    }
    if (n > FS_EPIPOLAR_CANDIDATES && best >= o->max_ratio * fs_match_distance(found[n - 1].dot))
        out->n = 0; // too many alike
}

static double searched_length(const SearchPhoto *b, const Pair *pair, double max_inverse_z)
{
    const double *r = pair->r, *t = pair->t;
    double side = b->camera->width > b->camera->height ? b->camera->width : b->camera->height, ends[2][2];
    for (int k = 0; k < 2; k++) { // of the ray through the middle
        double q = k * max_inverse_z, z = r[8] + q * t[2];
        if (z < 0.05) return 0.7 * side;
        ends[k][0] = b->camera->fx * (r[2] + q * t[0]) / z;
        ends[k][1] = b->camera->fy * (r[5] + q * t[1]) / z;
    }
    return fmin(hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]), 0.7 * side);
}

int fs_epipolar_search(const SearchPhoto *a, const SearchPhoto *b, double max_inverse_z,
                       const TriangulateOptions *options, Candidates *out, double *length_px, FsError *err)
{
    Search search = {.a = a, .b = b, .max_inverse_z = max_inverse_z, .options = options};
    for (int i = 0; i < a->features->n; i++) out[i].n = 0;
    *length_px = 0;
    if (b->features->n == 0 || !relate(a->camera, b->camera, &search.pair)) return 0;
    Ranked *sorted = malloc((size_t)b->features->n * 3 * sizeof *sorted);
    if (!sorted) return fs_error_memory(err);
    *length_px = searched_length(b, &search.pair, max_inverse_z);
    search.n_sorted = sort_planes(b, &search.pair, options->tolerance_px / b->camera->fx, sorted);
    search.sorted = sorted;
    for (int i = 0; i < a->features->n; i++) search_one(&search, i, &out[i]);
    free(sorted);
    return 0;
}

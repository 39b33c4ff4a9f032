// Every feature of every photo is a seed: its candidates in the other photos each say how far away the point would be;
// the distance with which most photos agree wins. Wrong candidates agree by chance too, so a point is believed when so
// many agreements would be expected less than `false_alarms` times among candidates that lie anywhere on their lines
// (a binomial tail). Then the points with most observations take their features, and lesser claims on them lose.
#include "poses/triangulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/linalg.h"
#include "base/memory.h"
#include "base/order.h"
#include "poses/epipolar.h"
#include "poses/refine.h"

const TriangulateOptions fs_triangulate_defaults = {
    .tolerance_px = 1.5f, .max_ratio = 0.85f, .max_distance = 0.65f, .false_alarms = 1e-3, .min_angle_deg = 1};

enum { MAX_OTHERS = 40, MAX_SEEN = MAX_OTHERS + 1 };

// Nearest depth of points, of the radius of the cameras: photos from farther apart than they are deep do not look
// alike.
#define NEAREST 0.7
// The places beside a photo's own, be each taken from with and without flash or not: it is that far from the
// NEIGHBOURth nearest other photo. The radius is 3.0 to 3.4 times that in the made captures (36 photos), 5 in a square
// of 100.
enum { NEIGHBOUR = 4 };
#define WAY_LONG 5.0    // radius of a long way, which is looked along once more, for what is nearer
#define WAY_NEAREST 2.0 // in the place of the radius then
#define WAY_GAIN 1.1    // times as many points are found then, or all stays as it was

typedef struct Proposal {
    double xyz[3];
    float error;
    int n;
    Seen seen[MAX_SEEN]; // the seed first
} Proposal;

typedef struct Proposals {
    Proposal *list;
    int n;
} Proposals;

typedef struct Work {
    const SearchPhoto *photo;
    int n;
    double max_inverse_z;
    const TriangulateOptions *options;
    Proposals *proposals; // (n) by photo of the seed
    int first;            // photo of job 0
    int status;           // FS_ERR_MEMORY once a job ran out
} Work;

void fs_triangulate_free(PointSet *points)
{
    free(points->point);
    free(points->seen);
    *points = (PointSet){0};
}

static Sight sight_of(const SearchPhoto *photo, Seen seen)
{
    const SearchPhoto *p = &photo[seen.photo];
    return (Sight){p->camera, {p->features->xy[2 * seen.feature], p->features->xy[2 * seen.feature + 1]}};
}

// ---- which photos a photo is compared with ----

// The nearest ones that look the same way (within 70 degrees).
static int choose_others(const Work *w, int a, int *others)
{
    Ranked *list = malloc((size_t)w->n * sizeof *list);
    if (!list) return FS_ERR_MEMORY;
    int n = 0;
    double ca[3], cb[3];
    fs_camera_centre(w->photo[a].camera, ca);
    const double *za = w->photo[a].camera->w2c + 8;
    for (int b = 0; b < w->n; b++) {
        if (b == a) continue;
        const double *zb = w->photo[b].camera->w2c + 8;
        if (v3_dot(za, zb) < cos(70 * M_PI / 180)) continue;
        fs_camera_centre(w->photo[b].camera, cb);
        list[n++] = (Ranked){v3_distance2(ca, cb), b};
    }
    fs_order_ranked(list, (size_t)n);
    if (n > MAX_OTHERS) n = MAX_OTHERS;
    for (int i = 0; i < n; i++) others[i] = list[i].index;
    free(list);
    return n;
}

// ---- one seed ----

static void point_on_ray(const Camera *c, const float ray[2], double inverse_z, double xyz[3])
{
    double z = 1 / fmax(inverse_z, 1e-9);
    fs_camera_to_world(c, (const double[3]){ray[0] * z, ray[1] * z, z}, xyz);
}

typedef struct Seed {
    const Work *work;
    int a, i;
    const int *others;
    const Candidates *const *candidates; // per other: (features of a)
    const double *length_px;             // per other
    int n_others;
} Seed;

// Photos that have a candidate within the tolerance of where they should see xyz: at most one each, the nearest.
static int agreeing(const Seed *s, const double xyz[3], Seen *seen, double *sum)
{
    const Work *w = s->work;
    int n = 0;
    *sum = 0;
    for (int o = 0; o < s->n_others; o++) {
        const Candidates *c = &s->candidates[o][s->i];
        double best = w->options->tolerance_px, pixel[2];
        int at = -1;
        if (c->n == 0 || !(fs_camera_project(w->photo[s->others[o]].camera, xyz, pixel) > 0)) continue;
        for (int k = 0; k < c->n; k++) {
            const float *xy = w->photo[s->others[o]].features->xy + 2 * c->candidate[k].feature;
            double e = hypot(pixel[0] - xy[0], pixel[1] - xy[1]);
            if (e < best) {
                best = e;
                at = c->candidate[k].feature;
            }
        }
        if (at < 0) continue;
        if (seen) seen[n] = (Seen){s->others[o], at};
        n++;
        *sum += best;
    }
    return n;
}

// Expected number of chance agreements at least as good: tests * P(at least k of m), each with its chance p, by the
// recurrence over the photos (Poisson-binomial).
static double chance(const Seed *s, int k)
{
    double at_least[MAX_OTHERS + 2] = {1}; // at_least[j]: probability of exactly j so far
    int tests = 0, m = 0;
    for (int o = 0; o < s->n_others; o++) {
        int n = s->candidates[o][s->i].n;
        if (n == 0) continue;
        tests += n;
        double p = fmin(0.5, n * 2 * s->work->options->tolerance_px / fmax(s->length_px[o], 1));
        m++;
        for (int j = m; j > 0; j--) at_least[j] = at_least[j] * (1 - p) + at_least[j - 1] * p;
        at_least[0] *= 1 - p;
    }
    double tail = 0;
    for (int j = m; j >= k && j >= 0; j--) tail += at_least[j];
    return tests * tail;
}

// Fills the proposal; false when nothing believable was found.
static bool try_seed(const Seed *s, Proposal *p)
{
    const Work *w = s->work;
    double best_sum = 0, sum, xyz[3], best[3];
    int most = 0, total = 0;
    for (int o = 0; o < s->n_others; o++) total += s->candidates[o][s->i].n > 0;
    if (total < 2) return false;
    for (int o = 0; o < s->n_others; o++)
        for (int k = 0; k < s->candidates[o][s->i].n; k++) {
            point_on_ray(w->photo[s->a].camera, w->photo[s->a].ray + 2 * s->i,
                         s->candidates[o][s->i].candidate[k].inverse_z, xyz);
            int n = agreeing(s, xyz, NULL, &sum);
            if (n < most || (n == most && sum >= best_sum) || n == 0) continue;
            most = n;
            best_sum = sum;
            memcpy(best, xyz, sizeof best);
        }
    if (most < 2) return false;
    p->seen[0] = (Seen){s->a, s->i};
    Sight sight[MAX_SEEN];
    for (int round = 0; round < 3; round++) { // least squares, then ask the photos again
        p->n = 1 + agreeing(s, best, p->seen + 1, &sum);
        for (int k = 0; k < p->n; k++) sight[k] = sight_of(w->photo, p->seen[k]);
        if (p->n < 3 || !fs_refine_point(sight, p->n, best)) return false;
    }
    p->n = 1 + agreeing(s, best, p->seen + 1, &sum);
    if (p->n < 3 || fs_refine_error(&sight[0], best) > w->options->tolerance_px) return false;
    // The first agreement made the hypothesis and proves nothing.
    if (chance(s, p->n - 2) > w->options->false_alarms) return false;
    for (int k = 0; k < p->n; k++) sight[k] = sight_of(w->photo, p->seen[k]);
    if (fs_refine_angle(sight, p->n, best) < w->options->min_angle_deg) return false;
    memcpy(p->xyz, best, sizeof best);
    p->error = (float)(sum / (p->n - 1));
    return true;
}

static void seeds_of_photo(void *context, int job, int worker)
{
    (void)worker;
    Work *w = context;
    int a = w->first + job, others[MAX_OTHERS], rc = 0;
    int n = choose_others(w, a, others), features = w->photo[a].features->n;
    Candidates *store = malloc(((size_t)features + 1) * (size_t)(n > 0 ? n : 1) * sizeof *store);
    const Candidates *candidates[MAX_OTHERS];
    double length_px[MAX_OTHERS];
    if (n < 0 || !store) rc = FS_ERR_MEMORY;
    for (int o = 0; o < n && rc == 0; o++) {
        Candidates *c = store + (size_t)o * (size_t)features;
        candidates[o] = c;
        rc = fs_epipolar_search(&w->photo[a], &w->photo[others[o]], w->max_inverse_z, w->options, c, &length_px[o],
                                NULL);
    }
    Seed seed = {w, a, 0, others, candidates, length_px, n};
    Proposal p;
    Proposals *found = &w->proposals[a];
    for (; seed.i < features && rc == 0; seed.i++) {
        if (!try_seed(&seed, &p)) continue;
        rc = fs_memory_grow(&found->list, found->n, sizeof p, NULL);
        if (rc == 0) found->list[found->n++] = p;
    }
    free(store);
    if (rc < 0) __atomic_store_n(&w->status, rc, __ATOMIC_RELAXED);
}

// ---- from proposals to points ----

static int compare_proposals(const void *a, const void *b)
{
    const Proposal *x = *(const Proposal *const *)a, *y = *(const Proposal *const *)b;
    if (x->n != y->n) return x->n > y->n ? -1 : 1;
    if (x->error != y->error) return x->error < y->error ? -1 : 1;
    if (x->seen[0].photo != y->seen[0].photo) return x->seen[0].photo < y->seen[0].photo ? -1 : 1;
    return (x->seen[0].feature > y->seen[0].feature) - (x->seen[0].feature < y->seen[0].feature);
}

typedef struct Claims {
    int **site;            // per photo (features): first feature at the same place
    unsigned char **taken; // per photo (features), by site
} Claims;

static int compare_sites(const void *a, const void *b)
{
    const float *x = *(const float *const *)a, *y = *(const float *const *)b;
    for (int k = 0; k < 2; k++)
        if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
    return (x > y) - (x < y);
}

// Features with two orientations are at one place and are one observation.
static int find_sites(const Features *f, int *site)
{
    const float **order = malloc(((size_t)f->n + 1) * sizeof *order);
    if (!order) return FS_ERR_MEMORY;
    for (int i = 0; i < f->n; i++) order[i] = f->xy + 2 * i;
    qsort(order, (size_t)f->n, sizeof *order, compare_sites);
    int first = 0;
    for (int i = 0; i < f->n; i++) {
        if (i == 0 || order[i][0] != order[i - 1][0] || order[i][1] != order[i - 1][1])
            first = (int)(order[i] - f->xy) / 2;
        site[(order[i] - f->xy) / 2] = first;
    }
    free(order);
    return 0;
}

static unsigned char *claim(const Claims *claims, Seen s)
{
    return &claims->taken[s.photo][claims->site[s.photo][s.feature]];
}

// Keeps of a proposal what is still free; true when enough is left for a point of its own.
static bool still_good(const SearchPhoto *photo, const Claims *claims, Proposal *p, const TriangulateOptions *o)
{
    int n = 0, before = p->n;
    Sight sight[MAX_SEEN];
    for (int k = 0; k < p->n; k++)
        if (!*claim(claims, p->seen[k])) p->seen[n++] = p->seen[k];
    p->n = n;
    if (n < 3 || n < 0.6 * before) return false;
    for (int k = 0; k < n; k++) sight[k] = sight_of(photo, p->seen[k]);
    if (!fs_refine_point(sight, n, p->xyz) || fs_refine_angle(sight, n, p->xyz) < o->min_angle_deg) return false;
    double sum = 0;
    for (int k = 0; k < n; k++) {
        double e = fs_refine_error(&sight[k], p->xyz);
        if (e > o->tolerance_px) return false;
        sum += e;
    }
    p->error = (float)(sum / n);
    return true;
}

static void accept(PointSet *points, const Claims *claims, const Proposal *p)
{
    for (int k = 0; k < p->n; k++) *claim(claims, p->seen[k]) = 1;
    Point *point = &points->point[points->n];
    *point = (Point){.error = p->error, .first = points->n_seen, .n = p->n};
    memcpy(point->xyz, p->xyz, sizeof point->xyz);
    memcpy(points->seen + points->n_seen, p->seen, (size_t)p->n * sizeof *p->seen);
    points->n++;
    points->n_seen += p->n;
}

static int settle(const Work *w, const Claims *claims, PointSet *points, FsError *err)
{
    size_t total = 0, seen = 0, at = 0;
    for (int a = 0; a < w->n; a++) {
        total += (size_t)w->proposals[a].n;
        seen += (size_t)w->photo[a].features->n;
    }
    Proposal **order = malloc((total + 1) * sizeof *order);
    points->point = malloc((total + 1) * sizeof *points->point);
    points->seen = malloc((seen + 1) * sizeof *points->seen); // no feature is used twice
    if (!order || !points->point || !points->seen) {
        free(order);
        return fs_error_memory(err);
    }
    for (int a = 0; a < w->n; a++)
        for (int k = 0; k < w->proposals[a].n; k++) order[at++] = &w->proposals[a].list[k];
    qsort(order, total, sizeof(Proposal *), compare_proposals);
    for (size_t k = 0; k < total; k++)
        if (still_good(w->photo, claims, order[k], w->options)) accept(points, claims, order[k]);
    free(order);
    return 0;
}

static int make_claims(const SearchPhoto *photo, int n, Claims *claims, Arena *arena, FsError *err)
{
    claims->site = ARENA_NEW(arena, int *, (size_t)n + 1);
    claims->taken = ARENA_NEW(arena, unsigned char *, (size_t)n + 1);
    for (int a = 0; a < n && !arena->failed; a++) {
        size_t features = (size_t)photo[a].features->n;
        claims->site[a] = ARENA_NEW(arena, int, features + 1);
        claims->taken[a] = ARENA_NEW(arena, unsigned char, features + 1);
        if (arena->failed || find_sites(photo[a].features, claims->site[a]) < 0) return fs_error_memory(err);
    }
    return arena->failed ? fs_error_memory(err) : 0;
}

static int make_photos(const PosedFeatures *photos, SearchPhoto *photo, Arena *arena, FsError *err)
{
    const Features *features = photos->features;
    const Camera *camera = photos->camera;
    for (int a = 0; a < photos->n; a++) {
        photo[a] = (SearchPhoto){&features[a], &camera[a], ARENA_NEW(arena, float, 2 * ((size_t)features[a].n + 1))};
        if (!photo[a].ray) return fs_error_memory(err);
        for (int i = 0; i < features[a].n; i++) {
            photo[a].ray[2 * i] = (float)((features[a].xy[2 * i] - camera[a].cx) / camera[a].fx);
            photo[a].ray[2 * i + 1] = (float)((features[a].xy[2 * i + 1] - camera[a].cy) / camera[a].fy);
        }
    }
    return 0;
}

// Typical distance of a photo from the nearest places that others were taken from.
static int find_spacing(const PosedFeatures *photos, double *spacing, FsError *err)
{
    int n = photos->n;
    double a[3], b[3], *to = malloc(2 * ((size_t)n + 1) * sizeof *to);
    if (!to) return fs_error_memory(err);
    double *nearest = to + n + 1;
    for (int i = 0; i < n; i++) {
        fs_camera_centre(&photos->camera[i], a);
        for (int k = 0; k < n; k++) {
            fs_camera_centre(&photos->camera[k], b);
            to[k] = sqrt(v3_distance2(a, b));
        }
        fs_order_doubles(to, (size_t)n);
        nearest[i] = to[NEIGHBOUR < n ? NEIGHBOUR : n - 1];
    }
    *spacing = fs_order_median(nearest, (size_t)n);
    free(to);
    return 0;
}

// Points no nearer to a photo than that.
static int look(Work *w, const Claims *claims, double least_z, Threads *threads, const Log *log, PointSet *points,
                FsError *err)
{
    int rc = 0, step = 2 * fs_threads_count(threads);
    *points = (PointSet){0};
    w->max_inverse_z = least_z > 0 ? 1 / least_z : 1;
    for (int a = 0; a < w->n; a++) memset(claims->taken[a], 0, (size_t)w->photo[a].features->n);
    w->proposals = calloc((size_t)w->n + 1, sizeof *w->proposals);
    if (!w->proposals) return fs_error_memory(err);
    for (w->first = 0; w->first < w->n; w->first += step) {
        fs_log_progress(log, "poses", w->first, w->n, "triangulating");
        if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "poses: cancelled while triangulating"));
        fs_threads_for(threads, step < w->n - w->first ? step : w->n - w->first, seeds_of_photo, w);
        if (w->status < 0) TRY(fs_error_memory(err));
    }
    TRY(settle(w, claims, points, err));
fail:
    for (int a = 0; a < w->n; a++) free(w->proposals[a].list);
    free(w->proposals);
    if (rc < 0) fs_triangulate_free(points);
    return rc;
}

// On a long way past a scene most of it is nearer than the way is long.
static int look_nearer(Work *w, const Claims *claims, double spacing, Threads *threads, const Log *log,
                       PointSet *points, FsError *err)
{
    PointSet nearer;
    MUST(look(w, claims, NEAREST * WAY_NEAREST * spacing, threads, log, &nearer, err));
    bool more = nearer.n > WAY_GAIN * points->n;
    PointSet worse = more ? *points : nearer;
    if (more) *points = nearer;
    fs_triangulate_free(&worse);
    return 0;
}

int fs_triangulate(const PosedFeatures *photos, const TriangulateOptions *options, Threads *threads, const Log *log,
                   PointSet *points, FsError *err)
{
    int rc = 0, n = photos->n;
    double centre[3], spacing = 0, radius = fs_camera_extent(photos->camera, sizeof(Camera), n, centre);
    Claims claims = {0};
    Arena arena = {0};
    SearchPhoto *photo = ARENA_NEW(&arena, SearchPhoto, (size_t)n + 1);
    Work work = {.photo = photo, .n = n, .options = options};
    *points = (PointSet){0};
    if (!photo) TRY(fs_error_memory(err));
    TRY(make_photos(photos, photo, &arena, err));
    TRY(make_claims(photo, n, &claims, &arena, err));
    TRY(find_spacing(photos, &spacing, err));
    TRY(look(&work, &claims, NEAREST * radius, threads, log, points, err));
    if (radius > WAY_LONG * spacing && spacing > 0)
        TRY(look_nearer(&work, &claims, spacing, threads, log, points, err));
fail:
    fs_arena_free(&arena);
    if (rc < 0) fs_triangulate_free(points);
    return rc;
}

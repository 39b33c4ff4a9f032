#include "initialise/plane_sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "initialise/constants.h"

enum { PLANES = 10, MOST_AT_ONCE = 4 };

void fs_plane_sweep_photos_free(SweepPhotos *photos)
{
    for (int i = 0; photos->fine && i < photos->views->n; i++) fs_image_free(&photos->fine[i]);
    free(photos->fine);
    *photos = (SweepPhotos){0};
}

void fs_plane_sweep_free(PlaneSweep *sweep)
{
    free(sweep->score[0]);
    free(sweep->score[1]);
    *sweep = (PlaneSweep){0};
}

// ---- photos without their slow parts ----

// Gaussian blur of one plane, separable, clamped at the border. temp (width * height + width + 2 * radius).
static void blur(float *px, float *temp, int width, int height, float sigma, int radius)
{
    float kernel[16], sum = 0, *row = temp + (size_t)width * (size_t)height;
    for (int k = 0; k <= radius; k++) {
        kernel[k] = expf(-(float)(k * k) / (2 * sigma * sigma));
        sum += k ? 2 * kernel[k] : kernel[k];
    }
    for (int k = 0; k <= radius; k++) kernel[k] /= sum;
    for (int y = 0; y < height; y++) {
        float *from = px + (size_t)y * (size_t)width, *to = temp + (size_t)y * (size_t)width;
        for (int x = 0; x < radius; x++) row[x] = from[0];
        memcpy(row + radius, from, sizeof(float) * (size_t)width);
        for (int x = 0; x < radius; x++) row[radius + width + x] = from[width - 1];
        for (int x = 0; x < width; x++) to[x] = kernel[0] * row[radius + x];
        for (int k = 1; k <= radius; k++)
            for (int x = 0; x < width; x++) to[x] += kernel[k] * (row[radius + x - k] + row[radius + x + k]);
    }
    for (int y = 0; y < height; y++) {
        float *to = px + (size_t)y * (size_t)width;
        const float *from = temp + (size_t)y * (size_t)width;
        for (int x = 0; x < width; x++) to[x] = kernel[0] * from[x];
        for (int k = 1; k <= radius; k++) {
            const float *lo = temp + (size_t)(y - k < 0 ? 0 : y - k) * (size_t)width;
            const float *hi = temp + (size_t)(y + k >= height ? height - 1 : y + k) * (size_t)width;
            for (int x = 0; x < width; x++) to[x] += kernel[k] * (lo[x] + hi[x]);
        }
    }
}

typedef struct Prepare {
    const SmallViews *views;
    Image *fine;
    SweepAim aim;
    bool failed; // out of memory
} Prepare;

static bool take_slow_off(const Image *photo, int sigma, Image *fine)
{
    int width = photo->width, height = photo->height;
    size_t n = (size_t)width * (size_t)height;
    float *slow = malloc(sizeof(float) * (2 * n + (size_t)width + 6 * (size_t)sigma)),
          *trusted = malloc(sizeof(float) * n);
    bool done = slow && trusted && fs_image_new(fine, width, height, 4, NULL) == 0;
    if (done) {
        for (size_t i = 0; i < n; i++) {
            const float *p = photo->px + 3 * i;
            if (!isfinite(p[0] + p[1] + p[2])) continue;
            for (int c = 0; c < 3; c++) fine->px[4 * i + (size_t)c] = p[c];
            fine->px[4 * i + 3] = 1;
        }
        for (int c = 3; c >= 0; c--) { // the trust first: the colours are divided by it
            for (size_t i = 0; i < n; i++) slow[i] = fine->px[4 * i + (size_t)c];
            blur(slow, slow + n, width, height, (float)sigma, 3 * sigma);
            for (size_t i = 0; i < n && c == 3; i++) trusted[i] = slow[i];
            for (size_t i = 0; i < n && c < 3; i++)
                if (fine->px[4 * i + 3] > 0) fine->px[4 * i + (size_t)c] -= slow[i] / trusted[i];
        }
    }
    free(slow);
    free(trusted);
    return done;
}

static void prepare_job(void *context, int job, int worker)
{
    (void)worker;
    Prepare *w = context;
    const Image *photo = &w->views->view[job].photo;
    bool done =
        w->aim == AIM_EDGES
            ? fs_edge_windows_fine(photo, &w->fine[job], NULL) == 0
            : take_slow_off(photo, w->aim == AIM_REFLECTED ? SWEEP_SLOW_SIGMA_R : SWEEP_SLOW_SIGMA_T, &w->fine[job]);
    if (!done) __atomic_store_n(&w->failed, true, __ATOMIC_RELAXED);
}

int fs_plane_sweep_prepare(const SmallViews *views, SweepAim aim, SweepPhotos *photos, Threads *threads, FsError *err)
{
    *photos = (SweepPhotos){views, aim, calloc((size_t)views->n + 1, sizeof(Image))};
    Prepare work = {views, photos->fine, aim, false};
    if (photos->fine) fs_threads_for(threads, views->n, prepare_job, &work);
    if (photos->fine && !work.failed) return 0;
    fs_plane_sweep_photos_free(photos);
    return fs_error_memory(err);
}

// ---- one step of depth ----

typedef float Four __attribute__((vector_size(16))); // r g b 1
typedef int Ints __attribute__((vector_size(16)));

typedef struct Sums { // per grid pixel, over the photos without [0] and with flash [1]
    Four sum[2], own[2];
} Sums;

typedef struct Warp { // a grid pixel (x, y) at inverse depth q is seen at (p0 / p2, p1 / p2), p = m (x, y, 1) + q t
    double m[9], t[3];
    int view;
    bool flash;
} Warp;

typedef struct Work {
    const SweepPhotos *photos;
    const DepthOdds *odds;
    PlaneSweep *sweep;
    Warp warp[2 * SWEEP_GROUP_R];
    int n_warps, at_once;         // steps of depth in a job
    double middle_m[3], middle_t; // depth in the middle view times q: m . (x, y, 1) + q t
    EdgeWindows windows;          // of AIM_EDGES
    Sums *sums;                   // per worker (at_once, height, width)
    float *planes;                // per worker, planes_size()
} Work;

// Fills warp->m, t for rays of `from` seen in `to`; focal lengths and centres of each in its own pixels.
static void set_warp(const Camera *from, const Camera *to, Warp *warp)
{
    double rotation[9], t[3];
    fs_camera_relative(from, to, rotation, t);
    for (int i = 0; i < 3; i++) {
        double *m = warp->m + 3 * i, *r = rotation + 3 * i;
        m[0] = r[0] / from->fx;
        m[1] = r[1] / from->fy;
        m[2] = r[2] - r[0] * from->cx / from->fx - r[1] * from->cy / from->fy;
        warp->t[i] = t[i];
    }
    for (int k = 0; k < 3; k++) {
        warp->m[k] = to->fx * warp->m[k] + to->cx * warp->m[6 + k];
        warp->m[3 + k] = to->fy * warp->m[3 + k] + to->cy * warp->m[6 + k];
    }
    warp->t[0] = to->fx * t[0] + to->cx * t[2];
    warp->t[1] = to->fy * t[1] + to->cy * t[2];
}

// The nearest photos of each lighting that look the same way.
static void choose_photos(Work *w, int view)
{
    const SmallViews *views = w->photos->views;
    const SmallView *from = &views->view[view];
    int most = w->photos->aim == AIM_REFLECTED ? SWEEP_GROUP_R : SWEEP_GROUP_T;
    w->n_warps = 0;
    for (int g = 0; g < 2; g++) {
        double after = -1; // squared distance and number of the one chosen last
        int after_i = -1;
        for (int k = 0; k < most; k++) {
            double best = INFINITY;
            int best_i = -1;
            for (int i = 0; i < views->n; i++) {
                const SmallView *f = &views->view[i];
                double d2 = v3_distance2(f->centre, from->centre);
                double axis = v3_dot(f->camera.w2c + 8, from->camera.w2c + 8);
                if (f->flash != g || axis < SWEEP_AXIS_MIN || d2 < after || (d2 == after && i <= after_i)) continue;
                if (d2 < best) {
                    best = d2;
                    best_i = i;
                }
            }
            if (best_i < 0) break;
            Warp *warp = &w->warp[w->n_warps++];
            warp->view = best_i;
            warp->flash = g;
            set_warp(&w->sweep->camera, &views->view[best_i].camera, warp);
            after = best;
            after_i = best_i;
        }
    }
}

static Four four_at(const float *p)
{
    Four v;
    memcpy(&v, p, sizeof v);
    return v;
}

// Where four grid pixels from u on are seen in a photo of width + 1, height + 1 pixels; false where none is.
static bool seen_at(const float m[3], const float row[3], float u, float width, float height, Four at[2], Ints *inside)
{
    const Four us = u + (Four){0, 1, 2, 3};
    Four depth = m[2] * us + row[2], x = (m[0] * us + row[0]) / depth - 0.5f, y = (m[1] * us + row[1]) / depth - 0.5f;
    *inside = (depth > 0) & (x >= 0) & (y >= 0) & (x < width) & (y < height);
    at[0] = (Four)((Ints)x & *inside); // others: a place that can be looked at, though it is not
    at[1] = (Four)((Ints)y & *inside);
    return (*inside)[0] | (*inside)[1] | (*inside)[2] | (*inside)[3];
}

static Four sample_four(const Image *fine, float x, float y)
{
    int ix = (int)x, iy = (int)y;
    float fx = x - (float)ix, fy = y - (float)iy;
    const float *a = fine->px + 4 * ((size_t)iy * (size_t)fine->width + (size_t)ix), *b = a + 4 * (size_t)fine->width;
    Four top = four_at(a), bottom = four_at(b);
    top += (four_at(a + 4) - top) * fx;
    bottom += (four_at(b + 4) - bottom) * fx;
    return top + (bottom - top) * fy;
}

// Adds one photo, seen at inverse depth q, to the sums of a row of grid pixels.
static void add_photo(const Warp *warp, const Image *fine, double q, int y, int width, Sums *sums)
{
    const double *m = warp->m, v = y + 0.5;
    const float slope[3] = {(float)m[0], (float)m[3], (float)m[6]};
    float row[3];
    for (int k = 0; k < 3; k++) row[k] = (float)(m[3 * k + 1] * v + m[3 * k + 2] + q * warp->t[k]);
    for (int x = 0; x < width; x += 4) {
        Four at[2];
        Ints inside;
        if (!seen_at(slope, row, (float)x + 0.5f, (float)(fine->width - 1), (float)(fine->height - 1), at, &inside))
            continue;
        for (int k = 0; k < 4 && x + k < width; k++) {
            Four value = sample_four(fine, at[0][k], at[1][k]);
            if (!inside[k] || value[3] < 0.999f) continue;
            Sums *s = &sums[x + k];
            s->sum[warp->flash] += value;
            s->own[warp->flash] += value * value;
        }
    }
}

// Value k of pixel i lies at k * plane + i * pixel.
typedef struct Pitch {
    size_t plane, pixel;
} Pitch;

// Sums -> the ten planes: products of different photos' values, their numbers, own products, their numbers.
// even: the products in shares of the photos' own, mean, product, and this more; 0: as they are.
static void spread(const Sums *sums, size_t n, float even, Pitch pitch, float *planes)
{
    for (size_t i = 0; i < n; i++) {
        Four N = sums[i].sum[0], F = sums[i].sum[1], NN = N * N - sums[i].own[0], NF = N * F,
             FF = F * F - sums[i].own[1];
        Four own_N = sums[i].own[0], own_F = sums[i].own[1];
        float own[2] = {own_N[0] + own_N[1] + own_N[2], own_F[0] + own_F[1] + own_F[2]}, share = 1;
        if (even > 0) share = 1 / ((own[0] + own[1]) / fmaxf(N[3] + F[3], 1) + even);
        float value[PLANES] = {share * (NN[0] + NN[1] + NN[2]),
                               share * (NF[0] + NF[1] + NF[2]),
                               share * (FF[0] + FF[1] + FF[2]),
                               NN[3],
                               NF[3],
                               FF[3],
                               share * own[0],
                               share * own[1],
                               N[3],
                               F[3]};
        for (size_t k = 0; k < PLANES; k++) planes[k * pitch.plane + i * pitch.pixel] = value[k];
    }
}

static void score(const float p[PLANES], float depth_odds, float *transmitted, float *reflected)
{
    *transmitted = *reflected = 0;
    if (!(p[3] > 0.5f && p[4] > 0.5f && p[5] > 0.5f)) return;
    double common, slope = fs_cue_slope((double)(p[0] / p[3]), (double)(p[1] / p[4]), (double)(p[2] / p[5]),
                                        (double)(p[6] / p[8]), (double)(p[7] / p[9]), &common);
    if (!(slope > 0)) return;
    float coherence = (float)common;
    float sigma =
        SWEEP_SIGMA_SURE + (SWEEP_SIGMA_UNSURE - SWEEP_SIGMA_SURE) * fmaxf(1 - coherence / SWEEP_SURE_COHERENCE, 0);
    float odds = fs_classify_slope_odds(logf((float)slope), sigma) + depth_odds;
    float share = 1 / (1 + expf(-fminf(fmaxf(odds, -20), 20)));
    *transmitted = coherence * share;
    *reflected = coherence * (1 - share);
}

// Floats per worker: the planes, and what blur() wants or their sums over windows.
static size_t planes_size(const Work *w)
{
    const Camera *grid = &w->sweep->camera;
    size_t n = (size_t)grid->width * (size_t)grid->height;
    size_t size =
        w->windows.weight ? 2 * EDGE_VALUES * n : (PLANES + 1) * n + (size_t)grid->width + 2 * SWEEP_BLUR_RADIUS;
    return (size + 15) / 16 * 16;
}

// The ten planes summed over windows, within a worker's floats.
static const float *window_planes(const Work *w, const Sums *sums, float *planes, Pitch *pitch)
{
    const Camera *grid = &w->sweep->camera;
    size_t n = (size_t)grid->width * (size_t)grid->height;
    float lift = fmaxf((float)w->photos->views->lift, 1);
    float even = w->photos->aim == AIM_REFLECTED ? 0 : SWEEP_EVEN_FLOOR * lift * lift;
    if (w->windows.weight) {
        *pitch = (Pitch){1, EDGE_VALUES};
        memset(planes, 0, sizeof(float) * EDGE_VALUES * n); // two values are not used
        spread(sums, n, even, *pitch, planes);
        fs_edge_windows_sum(&w->windows, planes, planes + EDGE_VALUES * n);
        return planes + EDGE_VALUES * n;
    }
    *pitch = (Pitch){n, 1};
    spread(sums, n, even, *pitch, planes);
    for (int k = 0; k < PLANES; k++)
        blur(planes + n * (size_t)k, planes + n * PLANES, grid->width, grid->height, SWEEP_WINDOW_SIGMA,
             SWEEP_BLUR_RADIUS);
    return planes;
}

// A step's sums -> its scores.
static void score_step(const Work *w, int step, double q, const Sums *sums, float *planes)
{
    const PlaneSweep *sweep = w->sweep;
    int width = sweep->camera.width, height = sweep->camera.height;
    size_t n = (size_t)width * (size_t)height;
    Pitch pitch;
    const float *value = window_planes(w, sums, planes, &pitch);
    for (size_t i = 0; i < n; i++) {
        float p[PLANES], u = (float)(i % (size_t)width) + 0.5f, v = (float)(i / (size_t)width) + 0.5f;
        for (size_t k = 0; k < PLANES; k++) p[k] = value[k * pitch.plane + i * pitch.pixel];
        double z = (w->middle_m[0] * (double)u + w->middle_m[1] * (double)v + w->middle_m[2]) / q + w->middle_t;
        float odds = z > 0 ? fs_classify_depth_odds(w->odds, (float)log(z)) : 0;
        size_t at = i * (size_t)sweep->steps + (size_t)step;
        score(p, odds, &sweep->score[0][at], &sweep->score[1][at]);
    }
}

// A few steps, row by row: they look at nearly the same places of the photos, which come from memory only once.
static void steps_job(void *context, int job, int worker)
{
    Work *w = context;
    const PlaneSweep *sweep = w->sweep;
    int width = sweep->camera.width, height = sweep->camera.height, at_once = w->at_once;
    int first = job * at_once, count = sweep->steps - first < at_once ? sweep->steps - first : at_once;
    size_t n = (size_t)width * (size_t)height;
    Sums *sums = w->sums + n * (size_t)at_once * (size_t)worker;
    double q[MOST_AT_ONCE];
    for (int s = 0; s < count; s++) q[s] = (double)sweep->inverse_min + (first + s) * (double)sweep->inverse_step;
    memset(sums, 0, sizeof *sums * n * (size_t)count);
    for (int y = 0; y < height; y++)
        for (int k = 0; k < w->n_warps; k++)
            for (int s = 0; s < count; s++)
                add_photo(&w->warp[k], &w->photos->fine[w->warp[k].view], q[s], y, width,
                          sums + n * (size_t)s + (size_t)y * (size_t)width);
    for (int s = 0; s < count; s++)
        score_step(w, first + s, q[s], sums + n * (size_t)s, w->planes + planes_size(w) * (size_t)worker);
}

static void set_middle(Work *w)
{
    const Camera *c = &w->sweep->camera;
    double direction[3] = {0}; // of the middle view's axis, in the grid's camera
    w->middle_t = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) direction[i] += c->w2c[4 * i + k] * w->photos->views->forward[k];
        w->middle_t -= direction[i] * c->w2c[4 * i + 3];
        w->middle_t -= w->photos->views->forward[i] * w->photos->views->centre[i];
    }
    w->middle_m[0] = direction[0] / c->fx;
    w->middle_m[1] = direction[1] / c->fy;
    w->middle_m[2] = direction[2] - direction[0] * c->cx / c->fx - direction[1] * c->cy / c->fy;
}

int fs_plane_sweep_run(const SweepPhotos *photos, int view, const DepthRange *range, const DepthOdds *odds,
                       Threads *threads, PlaneSweep *sweep, FsError *err)
{
    const Camera *camera = &photos->views->view[view].camera;
    int width = camera->width / SWEEP_DIVIDE > 0 ? camera->width / SWEEP_DIVIDE : 1;
    int height = camera->height / SWEEP_DIVIDE > 0 ? camera->height / SWEEP_DIVIDE : 1, rc = 0;
    size_t n = (size_t)width * (size_t)height, workers = (size_t)fs_threads_count(threads);
    *sweep = (PlaneSweep){
        fs_camera_resized(camera, width, height),
        range->steps,
        range->min,
        (range->max - range->min) / (float)(range->steps - 1),
        {calloc(n * (size_t)range->steps, sizeof(float)), calloc(n * (size_t)range->steps, sizeof(float))}};
    int at_once = range->steps / (int)workers; // so that each worker has a job
    at_once = at_once < 1 ? 1 : at_once > MOST_AT_ONCE ? MOST_AT_ONCE : at_once;
    Work w = {.photos = photos, .odds = odds, .sweep = sweep, .at_once = at_once};
    if (photos->aim == AIM_EDGES)
        TRY(fs_edge_windows_new(&photos->views->view[view].photo, width, height, &w.windows, err));
    w.sums = aligned_alloc(64, sizeof *w.sums * n * (size_t)at_once * workers);
    w.planes = aligned_alloc(64, sizeof(float) * planes_size(&w) * workers);
    if (!sweep->score[0] || !sweep->score[1] || !w.sums || !w.planes) TRY(fs_error_memory(err));
    choose_photos(&w, view);
    set_middle(&w);
    fs_threads_for(threads, (range->steps + at_once - 1) / at_once, steps_job, &w);
fail:
    fs_edge_windows_free(&w.windows);
    free(w.sums);
    free(w.planes);
    if (rc < 0) fs_plane_sweep_free(sweep);
    return rc;
}

#include "initialise/cue.h"

#include <math.h>

#include "base/order.h"
#include "initialise/constants.h"

enum { SAMPLES = CUE_SIDE * CUE_SIDE, VIEWS_MAX = 2 * CUE_GROUP_MAX };

typedef struct Patches {
    int n, n_flash;
    bool flash[VIEWS_MAX];
    float value[VIEWS_MAX][3][SAMPLES]; // mean taken off, times the root of the weight
    double gram[VIEWS_MAX][VIEWS_MAX];  // products of the patches
} Patches;

double fs_cue_slope(double a, double b, double c, double own_without, double own_with, double *coherence)
{
    b = fmax(b, 0);
    double root = sqrt((c - a) * (c - a) + 4 * b * b), common = (a + c + root) / 2;
    *coherence = 0;
    if (!(common > 0)) return 0;
    double slope = 2 * b > (c - a + root) / CUE_SLOPE_MAX ? (c - a + root) / (2 * b) : CUE_SLOPE_MAX;
    if (b == 0 && a >= c) return 0; // what is seen without flash is gone with it
    double all = (own_without + slope * slope * own_with + 2 * slope * b) / (1 + slope * slope);
    if (all > 0) *coherence = fmin(common / all, 1);
    return *coherence > 0 ? slope : 0;
}

// Looks the patch up in one photo. False when a sample is outside or not to be trusted.
static bool sample_patch(const SmallView *view, const double origin[3], const double right[3], const double down[3],
                         const float *weight, float value[3][SAMPLES])
{
    double mean[3] = {0};
    for (int i = 0; i < SAMPLES; i++) {
        double p[3], pixel[2], u = i % CUE_SIDE - CUE_SIDE / 2, v = i / CUE_SIDE - CUE_SIDE / 2;
        float rgb[3];
        for (int k = 0; k < 3; k++) p[k] = origin[k] + u * right[k] + v * down[k];
        if (!(fs_camera_project(&view->camera, p, pixel) > 0)) return false;
        if (!fs_small_views_sample(view, pixel[0], pixel[1], rgb)) return false;
        for (int c = 0; c < 3; c++) {
            value[c][i] = rgb[c];
            mean[c] += (double)(weight[i] * rgb[c]);
        }
    }
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < SAMPLES; i++) value[c][i] = (value[c][i] - (float)mean[c]) * sqrtf(weight[i]);
    return true;
}

static void gather(const SmallViews *views, const float xyz[3], const float *weight, Patches *patches)
{
    double origin[3] = {xyz[0], xyz[1], xyz[2]}, right[3], down[3], z = 0;
    for (int k = 0; k < 3; k++) z += (origin[k] - views->centre[k]) * views->forward[k];
    for (int k = 0; k < 3; k++) {
        right[k] = views->right[k] * z / views->focal_px;
        down[k] = views->down[k] * z / views->focal_px;
    }
    patches->n = patches->n_flash = 0;
    if (!(z > 0)) return;
    // Of large captures some photos, evenly.
    int n_group[2] = {views->n - views->n_flash, views->n_flash}, seen[2] = {0};
    for (int i = 0; i < views->n; i++) {
        const SmallView *view = &views->view[i];
        int g = view->flash;
        if (!fs_order_is_some(seen[g]++, n_group[g], CUE_GROUP_MAX)) continue;
        if (!sample_patch(view, origin, right, down, weight, patches->value[patches->n])) continue;
        patches->flash[patches->n++] = view->flash;
        patches->n_flash += view->flash;
    }
}

static float dot(const float *a, const float *b, int n)
{
    float sum[8] = {0};
    int i = 0;
    for (; i + 8 <= n; i += 8)
        for (int k = 0; k < 8; k++) sum[k] += a[i + k] * b[i + k];
    for (; i < n; i++) sum[0] += a[i] * b[i];
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

// Of the gram matrix, the photo `without` left out (-1: none). abc and own as in fs_cue_slope.
static double slope_of(const Patches *p, int without, double abc[3], double *coherence)
{
    double sum[3] = {0}, own[2] = {0};
    int n[2] = {0};
    for (int i = 0; i < p->n; i++) {
        if (i == without) continue;
        n[p->flash[i]]++;
        own[p->flash[i]] += p->gram[i][i];
        for (int j = 0; j < i; j++)
            if (j != without) sum[p->flash[i] + p->flash[j]] += p->gram[i][j];
    }
    abc[0] = sum[0] / (n[0] * (n[0] - 1) / 2);
    abc[1] = sum[1] / (n[0] * n[1]);
    abc[2] = sum[2] / (n[1] * (n[1] - 1) / 2);
    return fs_cue_slope(abc[0], abc[1], abc[2], own[0] / n[0], own[1] / n[1], coherence);
}

static void channel_slopes(const Patches *p, float slope[3])
{
    for (int c = 0; c < 3; c++) {
        float sum[2][SAMPLES] = {{0}};
        double own[2] = {0}, n[2] = {p->n - p->n_flash, p->n_flash};
        for (int i = 0; i < p->n; i++) {
            const float *v = p->value[i][c];
            for (int s = 0; s < SAMPLES; s++) sum[p->flash[i]][s] += v[s];
            own[p->flash[i]] += (double)dot(v, v, SAMPLES);
        }
        double a = ((double)dot(sum[0], sum[0], SAMPLES) - own[0]) / (n[0] * (n[0] - 1));
        double d = ((double)dot(sum[1], sum[1], SAMPLES) - own[1]) / (n[1] * (n[1] - 1));
        double b = (double)dot(sum[0], sum[1], SAMPLES) / (n[0] * n[1]);
        double coherence;
        slope[c] = (float)fs_cue_slope(a, b, d, own[0] / n[0], own[1] / n[1], &coherence);
        if (a <= 0 || coherence < CUE_COHERENCE_MIN) slope[c] = 0;
    }
}

static float clamped_log(double slope)
{
    return (float)log(fmin(fmax(slope, 1e-2), 1e2));
}

static Cue measure(const SmallViews *views, const float xyz[3], const float *weight, Patches *p)
{
    Cue cue = {0};
    gather(views, xyz, weight, p);
    if (p->n_flash < CUE_VIEWS_MIN || p->n - p->n_flash < CUE_VIEWS_MIN) return cue;
    double abc[3], left_out[3], coherence, ignored;
    for (int i = 0; i < p->n; i++) {
        for (int j = 0; j <= i; j++) p->gram[i][j] = (double)dot(p->value[i][0], p->value[j][0], 3 * SAMPLES);
    }
    double slope = slope_of(p, -1, abc, &coherence);
    if (!(slope > 0)) return cue;
    cue.log_slope = clamped_log(slope);
    cue.coherence = (float)coherence;
    double sum = 0, sum2 = 0;
    for (int i = 0; i < p->n; i++) {
        double x = (double)clamped_log(slope_of(p, i, left_out, &ignored)); // a slope of 0 counts as a very small one
        sum += x;
        sum2 += x * x;
    }
    double variance = (sum2 - sum * sum / p->n) * (p->n - 1) / p->n;
    cue.sigma = (float)sqrt(fmax(variance, 0));
    channel_slopes(p, cue.slope);
    cue.ok = cue.coherence > CUE_COHERENCE_MIN;
    return cue;
}

typedef struct CueWork {
    const SmallViews *views;
    const float *xyz, *weight;
    Cue *cue;
} CueWork;

static void cue_job(void *context, int i, int worker)
{
    (void)worker;
    const CueWork *w = context;
    Patches patches;
    w->cue[i] = measure(w->views, w->xyz + 3 * (size_t)i, w->weight, &patches);
}

void fs_cue_measure(const SmallViews *views, const float *xyz, int n, Cue *cue, Threads *threads)
{
    float weight[SAMPLES], sum = 0;
    for (int i = 0; i < SAMPLES; i++) {
        float u = (float)(i % CUE_SIDE - CUE_SIDE / 2), v = (float)(i / CUE_SIDE - CUE_SIDE / 2), s = CUE_SIDE / 4.0f;
        weight[i] = expf(-(u * u + v * v) / (2 * s * s));
        sum += weight[i];
    }
    for (int i = 0; i < SAMPLES; i++) weight[i] /= sum;
    CueWork work = {views, xyz, weight, cue};
    fs_threads_for(threads, n, cue_job, &work);
}

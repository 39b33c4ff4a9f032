#include "initialise/first_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/tone.h"
#include "initialise/paint.h"

#define OPACITY 0.1f
#define FEWEST 8            // points of a kind below which its depth is guessed
#define GUESS_FARTHER 2.0f  // a mirrored scene without points is put this many times behind the transmitted one
#define GLASS 0.08          // reflectance of a clean pane, both surfaces
#define BRIGHT_SCENE 0.8    // the mirrored room's own light at its bright places: fixes the pane's reflectance
#define BRIGHT_SHARE 0.95
#define F0_MIN 0.04
#define F0_MAX 0.5

// The points of one kind. Where there are hardly any: of all points (transmitted), or those moved back (mirrored).
static int pick(const Frames *frames, const Material *points, PointKind kind, float **xyz, int *n, FsError *err)
{
    const DensePoints *dense = points->dense[kind == POINT_REFLECTED];
    *n = 0;
    *xyz = malloc(sizeof(float) * 3 * ((size_t)points->n + (size_t)dense->n + 1));
    if (!*xyz) return fs_error_memory(err);
    int count[3] = {0};
    for (int i = 0; i < points->n; i++) count[points->kind[i]]++;
    bool guess = count[kind] + dense->n < FEWEST;
    PointKind from = guess && count[POINT_TRANSMITTED] >= FEWEST ? POINT_TRANSMITTED : kind;
    for (int i = 0; i < points->n; i++) {
        if (points->kind[i] != from && !(guess && from == kind)) continue;
        float *out = *xyz + 3 * (size_t)(*n)++;
        for (int k = 0; k < 3; k++) {
            float c = (float)frames->centre[k], p = points->xyz[3 * (size_t)i + (size_t)k];
            out[k] = guess && kind == POINT_REFLECTED ? c + (p - c) * GUESS_FARTHER : p;
        }
    }
    if (dense->n) memcpy(*xyz + 3 * (size_t)*n, dense->xyz, sizeof(float) * 3 * (size_t)dense->n);
    *n += dense->n;
    return 0;
}

static int cloud_from_seeds(const Seeds *seeds, const float *linear, const float *gain, Cloud *cloud, FsError *err)
{
    int rc = fs_cloud_new(cloud, seeds->n, linear ? 3 : 1, gain ? 1 : 0, err);
    if (rc < 0) return rc;
    memcpy(cloud->field[CLOUD_MEANS], seeds->xyz, sizeof(float) * 3 * (size_t)seeds->n);
    for (int i = 0; i < seeds->n; i++) {
        for (int k = 0; k < 3; k++) cloud->field[CLOUD_SCALES][3 * (size_t)i + (size_t)k] = logf(seeds->scale[i]);
        cloud->field[CLOUD_QUATS][4 * (size_t)i] = 1;
        cloud->field[CLOUD_OPACITIES][i] = logf(OPACITY / (1 - OPACITY));
        for (int k = 0; k < 3 && linear; k++)
            cloud->field[CLOUD_COLORS][3 * (size_t)i + (size_t)k] = fs_tone_encode(linear[3 * (size_t)i + (size_t)k]);
        if (gain) cloud->field[CLOUD_GAINS][i] = gain[i];
    }
    return 0;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The reflectance at which the mirrored room would be about as bright as a well exposed photo.
static int guess_f0(const float *R, int n, double *f0, FsError *err)
{
    float *green = malloc(sizeof *green * ((size_t)n + 1));
    if (!green) return fs_error_memory(err);
    for (int i = 0; i < n; i++) green[i] = R[3 * (size_t)i + 1];
    qsort(green, (size_t)n, sizeof *green, compare_floats);
    *f0 = n ? fmin(fmax((double)green[(int)(BRIGHT_SHARE * (n - 1))] / BRIGHT_SCENE, F0_MIN), F0_MAX) : F0_MIN;
    free(green);
    return 0;
}

// All points of both scenes, for comparisons that do not tell them apart.
static int pick_all(const Material *points, float **xyz, int *n, FsError *err)
{
    const DensePoints *const *dense = points->dense;
    *n = points->n + dense[0]->n + dense[1]->n;
    if (!(*xyz = malloc(sizeof(float) * 3 * ((size_t)*n + 1)))) return fs_error_memory(err);
    memcpy(*xyz, points->xyz, sizeof(float) * 3 * (size_t)points->n);
    float *to = *xyz + 3 * (size_t)points->n;
    for (int k = 0; k < 2; to += 3 * (size_t)dense[k++]->n)
        if (dense[k]->n) memcpy(to, dense[k]->xyz, sizeof(float) * 3 * (size_t)dense[k]->n);
    return 0;
}

// Reflectance of the pane towards a point, seen from the middle of the cameras.
static double reflectance(const Frames *frames, const Pane *pane, const float xyz[3])
{
    double d[3], n2 = 0, dot = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = xyz[k] - frames->centre[k];
        n2 += d[k] * d[k];
        dot += d[k] * pane->normal[k];
    }
    double c = n2 > 0 ? fmin(fabs(dot) / sqrt(n2), 1) : 1;
    return fs_pane_beta(pane, c);
}

typedef struct Palette {
    float *T_N, *T_F, *R; // linear
    float *gain, *alpha;  // of the transmitted seeds: (n, 1), (n, 3)
} Palette;

static void palette_free(Palette *p)
{
    free(p->T_N);
    free(p->T_F);
    free(p->R);
    free(p->gain);
    free(p->alpha);
}

static int mix_palette(const Frames *frames, const Material *points, const FlashLight *light, const Seeds *T,
                       const Seeds *R, Separation separation, Palette *p, Threads *threads, FsError *err)
{
    size_t n_T = (size_t)T->n, n_R = (size_t)R->n;
    p->T_N = malloc(sizeof(float) * 3 * n_T);
    p->T_F = malloc(sizeof(float) * 3 * n_T);
    p->R = malloc(sizeof(float) * 3 * n_R);
    p->gain = malloc(sizeof(float) * n_T);
    p->alpha = malloc(sizeof(float) * 3 * n_T);
    if (!p->T_N || !p->T_F || !p->R || !p->gain || !p->alpha) return fs_error_memory(err);
    int rc = fs_light_gains(frames, light, points->xyz, points->cue, points->kind, points->n, T->xyz, T->n, p->gain,
                            threads, err);
    if (rc < 0) return rc;
    for (size_t i = 0; i < n_T; i++) {
        double falloff = fs_light_falloff(frames, light, T->xyz + 3 * i);
        for (int c = 0; c < 3; c++) p->alpha[3 * i + (size_t)c] = (float)(light->color[c] * exp((double)p->gain[i]) * falloff);
    }
    if (separation != SEPARATION_FULL) memset(p->gain, 0, sizeof(float) * n_T);
    for (size_t i = 0; i < 3 * n_T && separation != SEPARATION_FULL; i++) // T_F's gain over T_N: none, or one per channel
        p->alpha[i] = separation == SEPARATION_LINEAR ? (float)light->color[i % 3] : 0;
    return fs_paint_layers(frames, T, R, p->alpha, p->T_N, p->T_F, p->R, threads, err);
}

static int fill_scene(const Frames *frames, const Seeds *T, const Seeds *R, Palette *p,
                      Scene *scene, FsError *err)
{
    int rc = 0;
    TRY(guess_f0(p->R, R->n, &scene->pane.f0, err));
    scene->pane.dimming = GLASS;
    for (int i = 0; i < R->n; i++) { // beta * R in the photos -> R, the room's own light
        double beta = scene->pane_beta ? reflectance(frames, &scene->pane, R->xyz + 3 * (size_t)i) : 0.5;
        for (int k = 0; k < 3; k++) p->R[3 * (size_t)i + (size_t)k] /= (float)beta;
    }
    TRY(cloud_from_seeds(T, p->T_N, scene->shared_geometry ? p->gain : NULL, &scene->cloud[LAYER_T_N], err));
    if (!scene->shared_geometry) TRY(cloud_from_seeds(T, p->T_F, NULL, &scene->cloud[LAYER_T_F], err));
    TRY(cloud_from_seeds(R, p->R, NULL, &scene->cloud[LAYER_R], err));
    if (!scene->pane_beta) TRY(cloud_from_seeds(T, NULL, NULL, &scene->cloud[LAYER_BETA], err)); // logit 0: beta = 0.5
fail:
    return rc;
}

int fs_first_scene_make(const Frames *frames, const Material *points, const FlashLight *light, const Settings *set,
                        Threads *threads, Scene *scene, FsError *err)
{
    int rc = 0, n_T, n_R;
    float *at_T = NULL, *at_R = NULL;
    Seeds T = {0}, R = {0};
    Palette palette = {0};
    *scene = (Scene){.shared_geometry = strcmp(set->geometry, "shared") == 0, .pane_beta = strcmp(set->beta, "pane") == 0,
                     .separation = fs_scene_separation(set->separation)};
    scene->extent = 1.1 * frames->extent;
    scene->flash_distance = light->distance;
    for (int k = 0; k < 3; k++) {
        scene->pane.normal[k] = frames->forward[k];
        scene->gain_color[k] = light->color[k];
    }
    if (scene->separation != SEPARATION_FULL && !(scene->shared_geometry && scene->pane_beta)) {
        rc = fs_error_set(err, FS_ERR_USAGE, "--separation %s goes with --geometry shared and --beta pane", set->separation);
        goto fail;
    }
    bool cued = scene->separation == SEPARATION_FULL || scene->separation == SEPARATION_LINEAR;
    TRY(cued ? pick(frames, points, POINT_TRANSMITTED, &at_T, &n_T, err) : pick_all(points, &at_T, &n_T, err));
    TRY(cued ? pick(frames, points, POINT_REFLECTED, &at_R, &n_R, err) : pick_all(points, &at_R, &n_R, err));
    TRY(fs_seeds_make(frames, at_T, n_T, set->init_count, 2 * (uint64_t)set->seed, threads, &T, err));
    TRY(fs_seeds_make(frames, at_R, n_R, set->init_count, 2 * (uint64_t)set->seed + 1, threads, &R, err));
    TRY(mix_palette(frames, points, light, &T, &R, scene->separation, &palette, threads, err));
    TRY(fill_scene(frames, &T, &R, &palette, scene, err));
    if (scene->separation == SEPARATION_NONE) {
        fs_cloud_free(&scene->cloud[LAYER_R]);
        scene->pane.f0 = scene->pane.dimming = 0;
    }
fail:
    palette_free(&palette);
    fs_seeds_free(&T);
    fs_seeds_free(&R);
    free(at_T);
    free(at_R);
    if (rc < 0) fs_scene_free(scene);
    return rc;
}

#include "initialise/colored_seeds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FEWEST 8           // points of a kind below which its depth is guessed
#define GUESS_FARTHER 2.0f // a mirrored scene without points is put this many times behind the transmitted one

void fs_colored_seeds_free(ColoredSeeds *p)
{
    fs_seeds_free(&p->T);
    fs_seeds_free(&p->R);
    free(p->T_N);
    free(p->T_F);
    free(p->R_color);
    free(p->gain);
    free(p->alpha);
    *p = (ColoredSeeds){0};
}

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

static int mix_colors(const Frames *frames, const Material *points, const FlashLight *light, ColoredSeeds *p,
                      Threads *threads, FsError *err)
{
    const Seeds *T = &p->T, *R = &p->R;
    size_t n_T = (size_t)T->n, n_R = (size_t)R->n;
    p->T_N = malloc(sizeof(float) * 3 * n_T);
    p->T_F = malloc(sizeof(float) * 3 * n_T);
    p->R_color = malloc(sizeof(float) * 3 * n_R);
    p->gain = malloc(sizeof(float) * n_T);
    p->alpha = malloc(sizeof(float) * 3 * n_T);
    if (!p->T_N || !p->T_F || !p->R_color || !p->gain || !p->alpha) return fs_error_memory(err);
    int rc = fs_light_gains(frames, light, points->xyz, points->cue, points->kind, points->n, T->xyz, T->n, p->gain,
                            threads, err);
    if (rc < 0) return rc;
    for (size_t i = 0; i < n_T; i++) {
        double falloff = fs_light_falloff(frames, light, T->xyz + 3 * i);
        for (int c = 0; c < 3; c++)
            p->alpha[3 * i + (size_t)c] = (float)(light->color[c] * exp((double)p->gain[i]) * falloff);
    }
    return fs_first_colors_find(frames, T, R, p->alpha, p->T_N, p->T_F, p->R_color, threads, err);
}

int fs_colored_seeds_make(const Frames *frames, const Material *points, const FlashLight *light, int count,
                          uint64_t seed, Threads *threads, ColoredSeeds *painted, FsError *err)
{
    int rc = 0, n_T, n_R;
    float *at_T = NULL, *at_R = NULL;
    *painted = (ColoredSeeds){0};
    TRY(pick(frames, points, POINT_TRANSMITTED, &at_T, &n_T, err));
    TRY(pick(frames, points, POINT_REFLECTED, &at_R, &n_R, err));
    TRY(fs_seeds_make(frames, at_T, n_T, count, 2 * seed, threads, &painted->T, err));
    TRY(fs_seeds_make(frames, at_R, n_R, count, 2 * seed + 1, threads, &painted->R, err));
    TRY(mix_colors(frames, points, light, painted, threads, err));
fail:
    free(at_T);
    free(at_R);
    if (rc < 0) fs_colored_seeds_free(painted);
    return rc;
}

#include "initialise/start.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "initialise/constants.h"

void fs_colored_seeds_free(ColoredSeeds *p)
{
    fs_seeds_free(&p->T);
    fs_seeds_free(&p->R);
    fs_arena_free(&p->arena);
    *p = (ColoredSeeds){0};
}

// The points of one kind. Where there are hardly any: of all points (transmitted), or those moved back (mirrored).
static int pick(const Start *start, PointKind kind, PointList *list, FsError *err)
{
    const SparsePoints *points = start->points;
    const PointList *dense = start->dense[kind == POINT_REFLECTED];
    int count[3] = {0};
    *list = (PointList){.xyz = malloc(sizeof(float) * 3 * ((size_t)points->n + (size_t)dense->n + 1)),
                        .alone = dense->alone};
    if (!list->xyz) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) count[points->kind[i]]++;
    bool guess = count[kind] + dense->n < COLORED_FEWEST;
    PointKind from = guess && count[POINT_TRANSMITTED] >= COLORED_FEWEST ? POINT_TRANSMITTED : kind;
    for (int i = 0; i < points->n; i++) {
        if (points->kind[i] != from && !(guess && from == kind)) continue;
        float *out = list->xyz + 3 * (size_t)list->n++;
        for (int k = 0; k < 3; k++) {
            float c = (float)start->views->centre[k], p = points->xyz[3 * (size_t)i + (size_t)k];
            out[k] = guess && kind == POINT_REFLECTED ? c + (p - c) * COLORED_GUESS_FARTHER : p;
        }
    }
    if (dense->n) memcpy(list->xyz + 3 * (size_t)list->n, dense->xyz, sizeof(float) * 3 * (size_t)dense->n);
    list->n += dense->n;
    return 0;
}

static int mix_colors(const Start *start, bool parted, ColoredSeeds *p, FsError *err)
{
    const Seeds *T = &p->T, *R = &p->R;
    const FlashLight *light = start->light;
    size_t n_T = (size_t)T->n, n_R = (size_t)R->n;
    p->T_N = ARENA_NEW(&p->arena, float, 3 * n_T);
    p->T_F = ARENA_NEW(&p->arena, float, 3 * n_T);
    p->R_color = ARENA_NEW(&p->arena, float, 3 * n_R);
    p->gain = ARENA_NEW(&p->arena, float, n_T);
    p->alpha = ARENA_NEW(&p->arena, float, 3 * n_T);
    if (p->arena.failed) return fs_error_memory(err);
    if (!parted) return fs_first_colors_of_photos(start->views, p, start->threads, err);
    int rc = fs_light_gains(start->views, light, start->points, T, p->gain, start->threads, err);
    if (rc < 0) return rc;
    for (size_t i = 0; i < n_T; i++) {
        double falloff = fs_light_falloff(start->views, light, T->xyz + 3 * i);
        for (int c = 0; c < 3; c++)
            p->alpha[3 * i + (size_t)c] = (float)(light->color[c] * exp((double)p->gain[i]) * falloff);
    }
    return fs_first_colors_find(start->views, p, start->threads, err);
}

int fs_colored_seeds_make(const Start *start, int count, bool parted, ColoredSeeds *seeds, FsError *err)
{
    int rc = 0;
    PointList T = {0}, R = {0};
    *seeds = (ColoredSeeds){0};
    TRY(pick(start, POINT_TRANSMITTED, &T, err));
    TRY(pick(start, POINT_REFLECTED, &R, err));
    TRY(fs_seeds_make(start->views, &T, count, 2 * start->seed, start->threads, &seeds->T, err));
    TRY(fs_seeds_make(start->views, &R, count, 2 * start->seed + 1, start->threads, &seeds->R, err));
    TRY(mix_colors(start, parted, seeds, err));
fail:
    fs_points_list_free(&T);
    fs_points_list_free(&R);
    if (rc < 0) fs_colored_seeds_free(seeds);
    return rc;
}

#include "initialise/start.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "initialise/constants.h"
#include "initialise/outliers.h"
#include "initialise/stereo.h"

// Gives both scenes as found so far colours, subtracts the other one from the photos and looks for this one in what is
// left: the points with so many votes.
static int look_again(const Start *start, SweepAim aim, float lit_odds, int votes, DepthMaps *maps, PointList *found,
                      FsError *err)
{
    bool reflected = aim == AIM_REFLECTED;
    int rc = 0;
    ColoredSeeds seeds = {0};
    SmallViews residual = {0};
    const Camera *camera = &start->views->view[0].camera;
    int count = (int)(RESIDUAL_SEEDS_PER_PIXEL * (float)camera->width * (float)camera->height);
    TRY(fs_colored_seeds_make(start, count, true, &seeds, err));
    const Seeds *other = reflected ? &seeds.T : &seeds.R;
    const float *without = reflected ? seeds.T_N : seeds.R_color, *with = reflected ? seeds.T_F : seeds.R_color;
    TRY(fs_first_colors_subtract(start->views, other, without, with, &residual, start->threads, err));
    TRY(fs_stereo_renew(start, &residual, aim, lit_odds, maps, err));
    fs_points_list_free(found);
    TRY(fs_stereo_fuse(maps, reflected, votes, found, err));
fail:
    fs_small_views_free(&residual);
    fs_colored_seeds_free(&seeds);
    return rc;
}

// ---- mirrored things as near as what is behind the pane ----

// Log of the odds for "transmitted" of a place's depth.
static float depth_odds(const Start *start, const float xyz[3])
{
    float place[3];
    return fs_small_views_direction(start->views, xyz, place) ? fs_classify_depth_odds(start->odds, place[2]) : 0;
}

// The points' kinds, but unsure are those called transmitted by their depth and neighbours alone. The caller frees.
static unsigned char *kinds_but_dull(const Start *start)
{
    const SparsePoints *p = start->points;
    unsigned char *kind = malloc((size_t)p->n + 1);
    if (!kind) return NULL;
    memcpy(kind, p->kind, (size_t)p->n);
    for (int i = 0; i < p->n; i++) {
        if (kind[i] != POINT_TRANSMITTED || depth_odds(start, p->xyz + 3 * (size_t)i) <= 0) continue;
        if (fs_classify_slope_odds(p->cue[i].log_slope, p->cue[i].sigma) < -NEAR_DULL) kind[i] = POINT_UNSURE;
    }
    return kind;
}

// A mirrored chair before the pane lies at depths where lit things lie, and its neighbours in space are lit: it is
// taken for transmitted. Without such dull points the transmitted scene does not explain it, so that it is left in the
// photos; what nearly all views then agree on is mirrored, wherever it lies. Adds to dense[1], alone: what is between
// such points and the others is more likely far. The transmitted maps are used up.
static int find_near(const Start *start, DepthMaps *maps, PointList dense[2], FsError *err)
{
    int rc = 0;
    PointList lit = {0}, found = {0};
    SparsePoints points = *start->points;
    Start without_dull = *start;
    points.kind = kinds_but_dull(start);
    if (!points.kind) TRY(fs_error_memory(err));
    fs_stereo_forget_dull(maps);
    TRY(fs_stereo_fuse(maps, false, STEREO_VOTES, &lit, err));
    TRY(fs_outliers_drop(&points, false, start->threads, &lit, err));
    without_dull.points = &points;
    without_dull.dense[0] = &lit;
    int votes = (int)fmaxf(ceilf(NEAR_AGREE * 2 * (float)(maps->n - 1)), STEREO_VOTES);
    TRY(look_again(&without_dull, AIM_REFLECTED, NEAR_LIT_ODDS, votes, maps, &found, err));
    for (int i = 0; i < found.n; i++) {
        const float *xyz = found.xyz + 3 * (size_t)i;
        if (depth_odds(start, xyz) <= NEAR_DEPTH) continue;
        TRY(fs_points_append(&dense[1], xyz, err));
        dense[1].alone++;
    }
fail:
    free(points.kind);
    fs_points_list_free(&lit);
    fs_points_list_free(&found);
    return rc;
}

int fs_residual_stereo_find(const Start *start, PointList dense[2], FsError *err)
{
    int rc = 0;
    DepthMaps maps = {0};
    Start with_dense = *start;
    for (int k = 0; k < 2; k++) {
        dense[k] = (PointList){0};
        with_dense.dense[k] = &dense[k];
    }
    TRY(fs_stereo_find(start, &maps, err));
    for (int k = 0; k < 2; k++) {
        TRY(fs_stereo_fuse(&maps, k, STEREO_VOTES, &dense[k], err));
        TRY(fs_outliers_drop(start->points, k, start->threads, &dense[k], err));
    }
    for (int k = 0; k < 2; k++) {
        TRY(look_again(&with_dense, k ? AIM_REFLECTED : AIM_TRANSMITTED, 1, STEREO_VOTES, &maps, &dense[k], err));
        TRY(fs_outliers_drop(start->points, k, start->threads, &dense[k], err));
    }
    TRY(find_near(&with_dense, &maps, dense, err));
    TRY(look_again(&with_dense, AIM_EDGES, 1, STEREO_VOTES, &maps, &dense[0], err));
    TRY(fs_outliers_drop(start->points, false, start->threads, &dense[0], err));
fail:
    fs_stereo_free(&maps);
    if (rc < 0)
        for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);
    return rc;
}

#include "initialise/start.h"

#include <limits.h>

#include "initialise/constants.h"
#include "initialise/outliers.h"
#include "initialise/stereo.h"

// Gives both scenes as found so far colours, subtracts the transmitted one from the photos and looks for the mirrored
// one in what is left. There, that a depth is one of the transmitted scene's tells less: what is mirrored as near as
// that has no sparse points, and would be lost.
static int find_mirrored(const Start *start, DepthMaps *maps, PointList *reflected, FsError *err)
{
    int rc = 0;
    ColoredSeeds seeds = {0};
    SmallViews residual = {0};
    DepthOdds odds = *start->odds;
    Start again = *start;
    const Camera *camera = &start->views->view[0].camera;
    int count = (int)(RESIDUAL_SEEDS_PER_PIXEL * (float)camera->width * (float)camera->height);
    again.odds = &odds;
    for (int d = 0; d < DEPTH_ODDS_STEPS; d++)
        if (odds.odds[d] > 0) odds.odds[d] *= RESIDUAL_DEPTH_WEIGHT;
    TRY(fs_colored_seeds_make(start, count, &seeds, err));
    TRY(fs_first_colors_subtract(start->views, &seeds.T, seeds.T_N, seeds.T_F, &residual, start->threads, err));
    TRY(fs_stereo_renew(&again, &residual, maps, err));
    fs_points_list_free(reflected);
    TRY(fs_stereo_fuse(maps, true, STEREO_VOTES, STEREO_VOTES_SURE, reflected, err));
    TRY(fs_outliers_drop(start->points, true, start->threads, reflected, err));
    TRY(fs_stereo_fuse(maps, true, STEREO_VOTES_SURE, INT_MAX, reflected, err));
fail:
    fs_small_views_free(&residual);
    fs_colored_seeds_free(&seeds);
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
        TRY(fs_stereo_fuse(&maps, k, STEREO_VOTES, INT_MAX, &dense[k], err));
        TRY(fs_outliers_drop(start->points, k, start->threads, &dense[k], err));
    }
    TRY(find_mirrored(&with_dense, &maps, &dense[1], err));
fail:
    fs_stereo_free(&maps);
    if (rc < 0)
        for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);
    return rc;
}

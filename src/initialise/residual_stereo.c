#include "initialise/start.h"

#include "initialise/constants.h"
#include "initialise/outliers.h"
#include "initialise/stereo.h"

// Gives both scenes as found so far colours, subtracts one from the photos and looks for the other in what is left.
static int find_again(const Start *start, bool reflected, DepthMaps *maps, PointList dense[2], FsError *err)
{
    int rc = 0;
    ColoredSeeds seeds = {0};
    SmallViews residual = {0};
    const Camera *camera = &start->views->view[0].camera;
    int count = (int)(RESIDUAL_SEEDS_PER_PIXEL * (float)camera->width * (float)camera->height);
    TRY(fs_colored_seeds_make(start, count, &seeds, err));
    const Seeds *other = reflected ? &seeds.T : &seeds.R;
    const float *without = reflected ? seeds.T_N : seeds.R_color, *with = reflected ? seeds.T_F : seeds.R_color;
    TRY(fs_first_colors_subtract(start->views, other, without, with, &residual, start->threads, err));
    TRY(fs_stereo_renew(start, &residual, reflected, maps, err));
    fs_points_list_free(&dense[reflected]);
    TRY(fs_stereo_fuse(maps, reflected, &dense[reflected], err));
    TRY(fs_outliers_drop(start->points, reflected, start->threads, &dense[reflected], err));
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
        TRY(fs_stereo_fuse(&maps, k, &dense[k], err));
        TRY(fs_outliers_drop(start->points, k, start->threads, &dense[k], err));
    }
    TRY(find_again(&with_dense, true, &maps, dense, err));
fail:
    fs_stereo_free(&maps);
    if (rc < 0)
        for (int k = 0; k < 2; k++) fs_points_list_free(&dense[k]);
    return rc;
}

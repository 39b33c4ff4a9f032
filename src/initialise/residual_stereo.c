#include "initialise/residual_stereo.h"

#include "initialise/outliers.h"

#define SEEDS_PER_PIXEL 1.0f // painted

// Paints both scenes as found so far, takes one off the photos and looks for the other in what is left.
static int peel(const Frames *frames, Material material, const FlashLight *light, bool reflected, const DepthOdds *odds,
                uint64_t seed, const Log *log, Threads *threads, DepthMaps *surfaces, DensePoints dense[2],
                FsError *err)
{
    int rc = 0;
    ColoredSeeds painted = {0};
    Frames freed = {0};
    const Camera *camera = &frames->frame[0].camera;
    int count = (int)(SEEDS_PER_PIXEL * (float)camera->width * (float)camera->height);
    material.dense[0] = &dense[0];
    material.dense[1] = &dense[1];
    TRY(fs_colored_seeds_make(frames, &material, light, count, seed, threads, &painted, err));
    if (reflected)
        TRY(fs_first_colors_subtract(frames, &painted.T, painted.T_N, painted.T_F, &freed, threads, err));
    else
        TRY(fs_first_colors_subtract(frames, &painted.R, painted.R_color, painted.R_color, &freed, threads, err));
    TRY(fs_stereo_renew(&freed, reflected, odds, log, threads, surfaces, err));
    fs_stereo_points_free(&dense[reflected]);
    TRY(fs_stereo_fuse(surfaces, reflected, &dense[reflected], err));
    TRY(fs_outliers_drop(material.xyz, material.kind, material.n, reflected, threads, &dense[reflected], err));
fail:
    fs_small_views_free(&freed);
    fs_colored_seeds_free(&painted);
    return rc;
}

int fs_residual_stereo_find(const Frames *frames, const Material *points, const FlashLight *light,
                            const DepthOdds *odds, uint64_t seed, const Log *log, Threads *threads,
                            DensePoints dense[2], FsError *err)
{
    int rc = 0;
    DepthMaps surfaces = {0};
    dense[0] = dense[1] = (DensePoints){0};
    TRY(fs_stereo_find(frames, points->xyz, points->kind, points->n, odds, log, threads, &surfaces, err));
    for (int k = 0; k < 2; k++) {
        TRY(fs_stereo_fuse(&surfaces, k, &dense[k], err));
        TRY(fs_outliers_drop(points->xyz, points->kind, points->n, k, threads, &dense[k], err));
    }
    TRY(peel(frames, *points, light, true, odds, seed, log, threads, &surfaces, dense, err));
fail:
    fs_stereo_free(&surfaces);
    if (rc < 0) {
        fs_stereo_points_free(&dense[0]);
        fs_stereo_points_free(&dense[1]);
    }
    return rc;
}

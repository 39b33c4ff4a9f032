// Thresholds from captures: the four rendered ones and ordinary made ones lie at 4.1 to 5.3 errors and a growth of 2,
// a made one with alpha 0.3, which still comes apart, at 2.0 and 1.24, one with alpha 0.1 at 0.2 and 1.07.
#include "initialise/start.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"
#include "initialise/constants.h"

typedef struct Growth {
    int n;
    double median, error; // of the growth's logarithm: the points' median, the median of their own errors
} Growth;

// Of one kind; n = 0 where there are none (or no memory: advice is a courtesy).
static Growth growth_of(const SparsePoints *points, PointKind wanted)
{
    Growth growth = {0};
    size_t size = (size_t)points->n + 1;
    double *slope = malloc(sizeof *slope * size), *sigma = malloc(sizeof *sigma * size);
    if (!slope || !sigma) fs_error_memory(NULL); // ends the run: it would give other advice
    for (int i = 0; slope && sigma && i < points->n; i++)
        if (points->kind[i] == wanted) {
            slope[growth.n] = (double)points->cue[i].log_slope;
            sigma[growth.n++] = (double)points->cue[i].sigma;
        }
    if (growth.n) growth.median = fs_order_median(slope, (size_t)growth.n);
    if (growth.n) growth.error = fs_order_median(sigma, (size_t)growth.n);
    free(slope);
    free(sigma);
    return growth;
}

// Median over the photos of the distance to the nearest photo of the other kind.
static double nearest_opposite(const SmallViews *views)
{
    double *nearest = malloc(sizeof *nearest * ((size_t)views->n + 1));
    if (!nearest) fs_error_memory(NULL);
    for (int i = 0; nearest && i < views->n; i++) {
        double best = INFINITY;
        for (int j = 0; j < views->n; j++) {
            if (views->view[i].flash == views->view[j].flash) continue;
            best = fmin(best, v3_distance2(views->view[i].centre, views->view[j].centre));
        }
        nearest[i] = sqrt(best);
    }
    double median = nearest ? fs_order_median(nearest, (size_t)views->n) : 0;
    free(nearest);
    return median;
}

static void advise_cue(const Growth *lit, const Growth *dull, const Log *log)
{
    double separation = (lit->median - dull->median) / fmax((lit->error + dull->error) / 2, ADVISE_ERROR_MIN);
    if (lit->n && dull->n) fs_log_info(log, "initialise: the two lie %.1f errors of a point apart", separation);
    if (lit->n && exp(lit->median) < ADVISE_SLOPE_MIN)
        fs_log_warn(log,
                    "weak flash: contrast behind the pane grows only %.2f times with it (%.2f or more is needed to "
                    "tell the scenes apart); go closer, use a stronger flash or a lower ambient light",
                    exp(lit->median), ADVISE_SLOPE_MIN);
    if (lit->n < ADVISE_FEW_POINTS)
        fs_log_warn(log,
                    "only %d points are surely behind the pane (%d are usual at least): too little texture or too "
                    "weak a flash; the separation will be poor",
                    lit->n, ADVISE_FEW_POINTS);
    if (dull->n < ADVISE_FEW_POINTS)
        fs_log_warn(log,
                    "only %d points are surely mirrored in the pane (%d are usual at least): the reflection is faint "
                    "or without texture, its depth will be a guess",
                    dull->n, ADVISE_FEW_POINTS);
    if (lit->n && dull->n && separation < ADVISE_SEPARATION_MIN)
        fs_log_warn(log,
                    "the flash cue separates the two scenes by only %.1f errors of a point (%.1f or more is sound): "
                    "expect parts of one scene in the other",
                    separation, ADVISE_SEPARATION_MIN);
}

static void advise_photos(const SmallViews *views, bool some_lit, const FlashLight *light, const Log *log)
{
    int n_flash = views->n_flash, fewer = n_flash < views->n - n_flash ? n_flash : views->n - n_flash;
    if (fewer == 0) return; // as was asked for
    if (fewer < ADVISE_FEW_PHOTOS)
        fs_log_warn(log,
                    "only %d photos %s the flash: what few photos see is left to chance; take 10 to 15 of each kind",
                    fewer, fewer == n_flash ? "with" : "without");
    double gap = nearest_opposite(views);
    if (some_lit && gap > ADVISE_FAR_SHARE * light->distance)
        fs_log_warn(log,
                    "flash and no-flash photos are far apart: the nearest photo of the other kind is %.0f %% of the "
                    "scene's distance away (at most %.0f %% is sound); take them in turns along one path",
                    100 * gap / light->distance, 100 * ADVISE_FAR_SHARE);
}

void fs_advise(const SmallViews *views, const SparsePoints *points, const FlashLight *light, const Log *log)
{
    Growth lit = growth_of(points, POINT_TRANSMITTED), dull = growth_of(points, POINT_REFLECTED);
    fs_log_info(log,
                "initialise: %d points transmitted (contrast grows %.2f times with the flash), %d reflected (%.2f "
                "times), %d unsure",
                lit.n, exp(lit.median), dull.n, exp(dull.median), points->n - lit.n - dull.n);
    advise_cue(&lit, &dull, log);
    advise_photos(views, lit.n > 0, light, log);
}

#include "initialise/intensity_cue.h"

#include <math.h>
#include <stdlib.h>

#include "initialise/depth_cue.h"

// Log of how much brighter the photos with the flash show a place; NAN: not seen in both lightings.
static double growth_of(const SmallViews *views, const float xyz[3])
{
    double sum[2] = {0, 0};
    int n[2] = {0, 0};
    for (int i = 0; i < views->n; i++) {
        const SmallView *view = &views->view[i];
        const double p[3] = {xyz[0], xyz[1], xyz[2]};
        double pixel[2];
        float rgb[3];
        if (!(fs_camera_project(&view->camera, p, pixel) > 0)) continue;
        if (!fs_small_views_sample(view, pixel[0], pixel[1], rgb)) continue;
        sum[view->flash] += (double)(rgb[0] + rgb[1] + rgb[2]);
        n[view->flash]++;
    }
    if (!n[0] || !n[1] || !(sum[0] > 0) || !(sum[1] > 0)) return NAN;
    return log(sum[1] / n[1] / (sum[0] / n[0]));
}

int fs_intensity_cue_part(const SmallViews *views, SparsePoints *points, double *growth, int *mirrored, FsError *err)
{
    size_t size = sizeof(double) * ((size_t)points->n + 1);
    double *value = malloc(size), *known = malloc(size), middle = INFINITY;
    int rc = 0, n = 0;
    *mirrored = 0;
    if (!value || !known) TRY(fs_error_memory(err));
    for (int i = 0; i < points->n; i++) {
        value[i] = growth_of(views, points->xyz + 3 * (size_t)i);
        if (isfinite(value[i])) known[n++] = value[i];
    }
    middle = fs_depth_cue_between_means(known, n);
    if (!isfinite(middle))
        TRY(fs_error_set(err, FS_ERR_INPUT,
                         "--flash-cue intensity: no two points differ in how much the flash raises their light; use "
                         "--flash-cue contrast"));
    for (int i = 0; i < points->n; i++) {
        bool rose = !(value[i] <= middle);
        points->kind[i] = rose ? POINT_TRANSMITTED : POINT_REFLECTED;
        *mirrored += !rose;
    }
    *growth = exp(middle);
fail:
    free(value);
    free(known);
    return rc;
}

#include "initialise/intensity_cue.h"

#include <math.h>
#include <stdlib.h>

#include "initialise/constants.h"

// Log of how much brighter the photos with the flash show a place; NAN: not seen in both lightings.
static float growth_of(const SmallViews *views, const float xyz[3])
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
    return (float)log(sum[1] / n[1] / (sum[0] / n[0]));
}

// Two means (Lloyd): what lies between them.
static double between_means(const float *value, int n)
{
    double mean[2] = {INFINITY, -INFINITY};
    for (int i = 0; i < n; i++) {
        if (!isfinite(value[i])) continue;
        mean[0] = fmin(mean[0], (double)value[i]);
        mean[1] = fmax(mean[1], (double)value[i]);
    }
    for (int round = 0; round < CUE_MEANS_ROUNDS && mean[1] > mean[0]; round++) {
        double sum[2] = {0, 0}, count[2] = {0, 0}, middle = (mean[0] + mean[1]) / 2;
        for (int i = 0; i < n; i++) {
            if (!isfinite(value[i])) continue;
            sum[(double)value[i] > middle] += (double)value[i];
            count[(double)value[i] > middle]++;
        }
        for (int k = 0; k < 2; k++) mean[k] = sum[k] / fmax(count[k], 1);
    }
    return mean[1] > mean[0] ? (mean[0] + mean[1]) / 2 : NAN;
}

int fs_intensity_cue_part(const SmallViews *views, SparsePoints *points, double *growth, int *mirrored, FsError *err)
{
    float *value = malloc(sizeof *value * ((size_t)points->n + 1));
    if (!value) return fs_error_memory(err);
    *mirrored = 0;
    for (int i = 0; i < points->n; i++) value[i] = growth_of(views, points->xyz + 3 * (size_t)i);
    double middle = between_means(value, points->n);
    *growth = exp(middle);
    for (int i = 0; i < points->n && isfinite(middle); i++) {
        bool rose = !((double)value[i] <= middle);
        points->kind[i] = rose ? POINT_TRANSMITTED : POINT_REFLECTED;
        *mirrored += !rose;
    }
    free(value);
    if (isfinite(middle)) return 0;
    return fs_error_set(err, FS_ERR_INPUT,
                        "--flash-cue intensity: no two points differ in how much the flash raises their light; use "
                        "--flash-cue contrast");
}

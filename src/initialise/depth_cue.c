#include "initialise/depth_cue.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "initialise/constants.h"

enum { SIDE = DEPTH_CUE_BINS, BINS = SIDE * SIDE };

typedef struct Place {
    double x, z; // to the right and ahead of the middle view
} Place;

static Place place_of(const SmallViews *views, const float xyz[3])
{
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = xyz[k] - views->centre[k];
    return (Place){v3_dot(d, views->right), v3_dot(d, views->forward)};
}

// The depth that the histograms span.
static int depth_range(const SmallViews *views, const SparsePoints *points, double *range, FsError *err)
{
    int n = 0;
    float *z = malloc(sizeof *z * ((size_t)points->n + 1));
    if (!z) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) {
        double depth = place_of(views, points->xyz + 3 * (size_t)i).z;
        if (depth > 0) z[n++] = (float)depth;
    }
    fs_order_floats(z, (size_t)n);
    *range = n ? DEPTH_CUE_REACH * (double)z[(int)(DEPTH_CUE_WITHIN * (n - 1))] : 0;
    free(z);
    if (*range > 0) return 0;
    return fs_error_set(err, FS_ERR_INPUT, "no point of the poses lies before the cameras; run the poses stage again");
}

// How many more points the flash photos make in each bin: rows of depth, columns to the right.
static void count_bins(const SmallViews *views, const SparsePoints *points, double range, double *bin)
{
    memset(bin, 0, sizeof *bin * BINS);
    for (int i = 0; i < points->n; i++) {
        Place p = place_of(views, points->xyz + 3 * (size_t)i);
        double x = floor((p.x / range + 0.5) * SIDE), z = floor(p.z / range * SIDE);
        if (!(x >= 0 && x < SIDE && z >= 0 && z < SIDE)) continue;
        bin[(int)z * SIDE + (int)x] +=
            (points->sightings[i][1] >= DEPTH_CUE_SIGHTINGS) - (points->sightings[i][0] >= DEPTH_CUE_SIGHTINGS);
    }
    for (int i = 0; i < BINS; i++) bin[i] = copysign(pow(fabs(bin[i]), DEPTH_CUE_POWER), bin[i]);
}

// One line of bins, `step` apart; beyond its ends it is mirrored.
static void blur_line(double *line, int step)
{
    double out[SIDE];
    const int radius = (int)(4 * DEPTH_CUE_SIGMA);
    for (int i = 0; i < SIDE; i++) {
        double sum = 0, weights = 0;
        for (int d = -radius; d <= radius; d++) {
            int j = i + d < 0 ? -1 - (i + d) : i + d >= SIDE ? 2 * SIDE - 1 - (i + d) : i + d;
            double w = exp(-0.5 * d * d / (DEPTH_CUE_SIGMA * DEPTH_CUE_SIGMA));
            sum += w * line[j * step];
            weights += w;
        }
        out[i] = sum / weights;
    }
    for (int i = 0; i < SIDE; i++) line[i * step] = out[i];
}

double fs_depth_cue_between_means(const double *value, int n)
{
    double mean[2] = {INFINITY, -INFINITY};
    for (int i = 0; i < n; i++) {
        mean[0] = fmin(mean[0], value[i]);
        mean[1] = fmax(mean[1], value[i]);
    }
    for (int round = 0; round < CUE_MEANS_ROUNDS && mean[1] > mean[0]; round++) {
        double sum[2] = {0, 0}, count[2] = {0, 0}, middle = (mean[0] + mean[1]) / 2;
        for (int i = 0; i < n; i++) {
            sum[value[i] > middle] += value[i];
            count[value[i] > middle]++;
        }
        for (int k = 0; k < 2; k++) mean[k] = sum[k] / fmax(count[k], 1);
    }
    return mean[1] > mean[0] ? (mean[0] + mean[1]) / 2 : INFINITY;
}

int fs_depth_cue_find(const SmallViews *views, const SparsePoints *found, double *depth, FsError *err)
{
    double range = 0, *bin = malloc(sizeof *bin * BINS);
    int rc = 0, last = -1;
    if (!bin) return fs_error_memory(err);
    TRY(depth_range(views, found, &range, err));
    count_bins(views, found, range, bin);
    for (int i = 0; i < SIDE; i++) blur_line(bin + i * SIDE, 1);
    for (int i = 0; i < SIDE; i++) blur_line(bin + i, SIDE);
    double least = fs_depth_cue_between_means(bin, BINS);
    for (int i = 0; i < BINS; i++)
        if (bin[i] > fmax(least, 0)) last = i / SIDE;
    if (last < 0)
        TRY(fs_error_set(err, FS_ERR_INPUT,
                         "--flash-cue depth: nowhere do photos with the flash find more points than those without; "
                         "use --flash-cue contrast"));
    *depth = (last + 2) * range / SIDE; // one row more
fail:
    free(bin);
    return rc;
}

int fs_depth_cue_part(const SmallViews *views, double depth, SparsePoints *points)
{
    int mirrored = 0;
    for (int i = 0; i < points->n; i++) {
        bool beyond = place_of(views, points->xyz + 3 * (size_t)i).z > depth;
        points->kind[i] = beyond ? POINT_REFLECTED : POINT_TRANSMITTED;
        mirrored += beyond;
    }
    return mirrored;
}

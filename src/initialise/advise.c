#include "initialise/advise.h"

#include <math.h>
#include <stdlib.h>

#define SLOPE_MIN 1.2 // median contrast growth of the transmitted points
#define FEW_POINTS 100
#define FAR_SHARE 0.25     // distance to the nearest photo of the other kind, against the transmitted scene's distance
#define SEPARATION_MIN 2.0 // distance between the two kinds' growth, in spreads

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Median and spread (half the middle two thirds) of the growth's logarithm of one kind.
static bool growth(const Cue *cue, const unsigned char *kind, int n, PointKind wanted, float *median, float *spread)
{
    float *value = malloc(sizeof *value * ((size_t)n + 1));
    int m = 0;
    if (!value) return false;
    for (int i = 0; i < n; i++)
        if (kind[i] == wanted) value[m++] = cue[i].log_slope;
    qsort(value, (size_t)m, sizeof *value, compare_floats);
    if (m) {
        *median = value[m / 2];
        *spread = 0.5f * (value[(int)(0.8333f * (float)(m - 1))] - value[(int)(0.1667f * (float)(m - 1))]);
    }
    free(value);
    return m > 0;
}

// Median over the photos of the distance to the nearest photo of the other kind.
static double nearest_opposite(const Frames *frames)
{
    float *value = malloc(sizeof *value * ((size_t)frames->n + 1));
    if (!value || !frames->n) {
        free(value);
        return 0;
    }
    for (int i = 0; i < frames->n; i++) {
        double best = INFINITY;
        for (int j = 0; j < frames->n; j++) {
            if (frames->frame[i].flash == frames->frame[j].flash) continue;
            double d2 = 0;
            for (int k = 0; k < 3; k++) d2 += pow(frames->frame[i].centre[k] - frames->frame[j].centre[k], 2);
            best = fmin(best, d2);
        }
        value[i] = (float)sqrt(best);
    }
    qsort(value, (size_t)frames->n, sizeof *value, compare_floats);
    double median = (double)value[frames->n / 2];
    free(value);
    return median;
}

void fs_advise(const Frames *frames, const float *xyz, const Cue *cue, const unsigned char *kind, int n,
               const FlashLight *light, const Log *log)
{
    (void)xyz;
    int count[3] = {0};
    for (int i = 0; i < n; i++) count[kind[i]]++;
    float lit = 0, lit_spread = 0, dull = 0, dull_spread = 0;
    bool some_lit = growth(cue, kind, n, POINT_TRANSMITTED, &lit, &lit_spread);
    bool both = growth(cue, kind, n, POINT_REFLECTED, &dull, &dull_spread) && some_lit;
    fs_log_info(log,
                "initialise: %d points transmitted (contrast grows %.2f times with the flash), %d reflected (%.2f "
                "times), %d unsure",
                count[POINT_TRANSMITTED], exp((double)lit), count[POINT_REFLECTED], exp((double)dull),
                count[POINT_UNSURE]);
    if (count[POINT_TRANSMITTED] && exp((double)lit) < SLOPE_MIN)
        fs_log_warn(log,
                    "weak flash: contrast behind the pane grows only %.2f times with it (%.1f or more is needed to "
                    "tell the scenes apart); go closer, use a stronger flash or a lower ambient light",
                    exp((double)lit), SLOPE_MIN);
    if (count[POINT_TRANSMITTED] < FEW_POINTS)
        fs_log_warn(log,
                    "only %d points are surely behind the pane (%d are usual at least): too little texture or too "
                    "weak a flash; the separation will be poor",
                    count[POINT_TRANSMITTED], FEW_POINTS);
    if (count[POINT_REFLECTED] < FEW_POINTS)
        fs_log_warn(log,
                    "only %d points are surely mirrored in the pane (%d are usual at least): the reflection is faint "
                    "or without texture, its depth will be a guess",
                    count[POINT_REFLECTED], FEW_POINTS);
    double spread = fmax((double)(lit_spread + dull_spread) / 2, 0.02);
    if (both && (double)(lit - dull) < SEPARATION_MIN * spread)
        fs_log_warn(log,
                    "the flash cue separates the two scenes by only %.1f spreads (%.1f or more is sound): expect "
                    "parts of one scene in the other",
                    (double)(lit - dull) / spread, SEPARATION_MIN);
    double gap = nearest_opposite(frames);
    if (count[POINT_TRANSMITTED] && gap > FAR_SHARE * light->distance)
        fs_log_warn(log,
                    "flash and no-flash photos are far apart: the nearest photo of the other kind is %.0f %% of the "
                    "scene's distance away (at most %.0f %% is sound); take them in turns along one path",
                    100 * gap / light->distance, 100 * FAR_SHARE);
}

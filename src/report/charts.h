// Drawings of the page, as SVG: where the photos were taken, and how the training went.
#ifndef FS_REPORT_CHARTS_H
#define FS_REPORT_CHARTS_H

#include <stdio.h>

#include "model/dataset.h"

// The cameras from above their common plane, flash and no-flash, with their directions.
void fs_charts_cameras(FILE *f, const Dataset *dataset);

// The training log: points of (step, value).
typedef struct Curve {
    double *step, *value;
    int n;
    double seconds; // at the last point
} Curve;

// OUT/log.jsonl, the photometric loss; n = 0 when there is no log. Lines that are not JSON are passed over.
int fs_charts_read_log(const char *path, Curve *curve, FsError *err);
void fs_charts_free_curve(Curve *curve);
void fs_charts_curve(FILE *f, const Curve *curve);

#endif

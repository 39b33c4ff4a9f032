// How alike two pictures are: a table of metrics over tone-mapped RGB images of one size, values 0..1.
#pragma once

#include "evaluate/lpips.h"

typedef enum Metric { METRIC_PSNR, METRIC_SSIM, METRIC_MS_SSIM, METRIC_LPIPS_ALEX, METRIC_LPIPS_VGG, METRICS } Metric;

typedef struct MetricContext {
    const Lpips *lpips; // NULL: no weights, LPIPS is not measured
    Threads *threads;   // for the metrics that use them
} MetricContext;

typedef struct MetricInfo {
    const char *name;   // in JSON: "psnr"
    const char *title;  // in tables: "PSNR"
    const char *format; // of a value in tables, as wide as the title column
    bool threaded;      // uses MetricContext.threads: one picture after the other
    // *value stays NAN where there is none.
    int (*measure)(const Image *truth, const Image *estimate, const MetricContext *context, double *value,
                   FsError *err);
} MetricInfo;
extern const MetricInfo fs_metrics[METRICS];

// PSNR in dB over all pixels and channels, at most 120.
int fs_metrics_psnr(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err);
// SSIM: mean over all pixels and channels, images taken as 0 outside.
int fs_metrics_ssim(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err);
// MS-SSIM (Wang, Simoncelli, Bovik 2003): whole windows only, 2x2 means between scales, negative contrast terms as 0,
// mean over channels. NAN where an image is smaller than a window.
int fs_metrics_ms_ssim(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err);
// 5 scales; fewer (their exponents scaled up to sum to 1) where the smallest would not hold a window.
int fs_metrics_ms_ssim_scales(int width, int height);

// The table of metrics; PSNR, SSIM and multi-scale SSIM in double.
#include "evaluate/metrics.h"

#include <math.h>
#include <stdlib.h>

#include "evaluate/window.h"

#define SCALES 5

static const double exponent[SCALES] = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};

static int lpips_alex(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err)
{
    if (!fs_lpips_has(context->lpips, LPIPS_ALEX)) return 0;
    return fs_lpips_distance(context->lpips, LPIPS_ALEX, a, b, context->threads, value, err);
}

static int lpips_vgg(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err)
{
    if (!fs_lpips_has(context->lpips, LPIPS_VGG)) return 0;
    return fs_lpips_distance(context->lpips, LPIPS_VGG, a, b, context->threads, value, err);
}

const MetricInfo fs_metrics[METRICS] = {
    [METRIC_PSNR] = {"psnr", "PSNR", "%6.2f", false, fs_metrics_psnr},
    [METRIC_SSIM] = {"ssim", "SSIM", "%6.4f", false, fs_metrics_ssim},
    [METRIC_MS_SSIM] = {"ms_ssim", "MS-SSIM", "%7.4f", false, fs_metrics_ms_ssim},
    [METRIC_LPIPS_ALEX] = {"lpips_alex", "LPIPS-A", "%7.4f", true, lpips_alex},
    [METRIC_LPIPS_VGG] = {"lpips_vgg", "LPIPS-V", "%7.4f", true, lpips_vgg},
};

int fs_metrics_psnr(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err)
{
    (void)context, (void)err;
    size_t n = fs_image_values(a);
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += ((double)a->px[i] - (double)b->px[i]) * ((double)a->px[i] - (double)b->px[i]);
    *value = -10 * log10(fmax(sum / (double)n, 1e-12));
    return 0;
}

static void plane(const Image *image, int channel, double *to)
{
    for (size_t i = 0; i < fs_image_pixels(image); i++)
        to[i] = (double)image->px[i * (size_t)image->channels + (size_t)channel];
}

// The sum of what compare makes of each channel's two planes.
static int over_channels(double (*compare)(double *a, double *b, int width, int height, double *scratch),
                         const Image *a, const Image *b, double *sum, FsError *err)
{
    size_t n = fs_image_pixels(a);
    double *pa = malloc(sizeof(double) * (2 * n + fs_window_scratch(a->width, a->height)));
    if (!pa) return fs_error_memory(err);
    *sum = 0;
    for (int c = 0; c < a->channels; c++) {
        plane(a, c, pa);
        plane(b, c, pa + n);
        *sum += compare(pa, pa + n, a->width, a->height, pa + 2 * n);
    }
    free(pa);
    return 0;
}

static double ssim_plane(double *a, double *b, int width, int height, double *scratch)
{
    return fs_window_compare(a, b, width, height, 0, scratch).ssim;
}

int fs_metrics_ssim(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err)
{
    (void)context;
    int rc = over_channels(ssim_plane, a, b, value, err);
    *value /= (double)fs_image_pixels(a) * a->channels;
    return rc;
}

int fs_metrics_ms_ssim_scales(int width, int height)
{
    int side = width < height ? width : height, scales = 0;
    for (; scales < SCALES && side >= FS_WINDOW_SIZE; scales++) side /= 2;
    return scales;
}

// In place: 2x2 means; a last odd row or column is left out.
static void halve(double *p, int width, int height)
{
    size_t w = (size_t)width, half = (size_t)(width / 2);
    for (size_t y = 0; y < (size_t)(height / 2); y++)
        for (size_t x = 0; x < half; x++) {
            const double *q = p + 2 * y * w + 2 * x;
            p[y * half + x] = (q[0] + q[1] + q[w] + q[w + 1]) / 4;
        }
}

static double ms_ssim_plane(double *a, double *b, int width, int height, double *scratch)
{
    int scales = fs_metrics_ms_ssim_scales(width, height);
    double product = 1, sum = 0;
    for (int s = 0; s < scales; s++) sum += exponent[s];
    for (int s = 0; s < scales; s++) {
        WindowSums w = fs_window_compare(a, b, width, height, FS_WINDOW_RADIUS, scratch);
        double term = (s == scales - 1 ? w.ssim : w.contrast) / w.pixels;
        product *= pow(fmax(term, 0), exponent[s] / sum);
        halve(a, width, height);
        halve(b, width, height);
        width /= 2;
        height /= 2;
    }
    return product;
}

int fs_metrics_ms_ssim(const Image *a, const Image *b, const MetricContext *context, double *value, FsError *err)
{
    (void)context;
    *value = NAN;
    if (fs_metrics_ms_ssim_scales(a->width, a->height) == 0) return 0;
    int rc = over_channels(ms_ssim_plane, a, b, value, err);
    *value /= a->channels;
    return rc;
}

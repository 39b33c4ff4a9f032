// SSIM(a, b) = l * cs with, under a Gaussian window, means m, variances v and covariance c:
//   l = (2 ma mb + C1) / (ma^2 + mb^2 + C1),  cs = (2 cab + C2) / (va + vb + C2),  C1 = 0.01^2, C2 = 0.03^2.
#include "evaluate/window.h"

#include <math.h>
#include <string.h>

static void kernel(double k[FS_WINDOW_SIZE])
{
    double sum = 0;
    for (int i = 0; i < FS_WINDOW_SIZE; i++) {
        double x = i - FS_WINDOW_RADIUS;
        k[i] = exp(-x * x / (2 * 1.5 * 1.5));
        sum += k[i];
    }
    for (int i = 0; i < FS_WINDOW_SIZE; i++) k[i] /= sum;
}

static size_t row_length(int width)
{
    return (size_t)width + 2 * FS_WINDOW_RADIUS;
}

size_t fs_window_scratch(int width, int height)
{
    return 6 * (size_t)width * (size_t)height + row_length(width); // five averages, one product, one padded row
}

static void filter(const double *in, int width, int height, double *out, double *scratch)
{
    double k[FS_WINDOW_SIZE];
    kernel(k);
    size_t w = (size_t)width;
    double *padded = scratch, *row = scratch + FS_WINDOW_RADIUS;
    memset(padded, 0, sizeof(double) * row_length(width));
    for (int y = 0; y < height; y++) {
        memset(row, 0, sizeof(double) * w);
        for (int j = 0; j < FS_WINDOW_SIZE; j++) {
            int from = y + j - FS_WINDOW_RADIUS;
            if (from < 0 || from >= height) continue;
            const double *line = in + (size_t)from * w, weight = k[j];
            for (size_t x = 0; x < w; x++) row[x] += weight * line[x];
        }
        double *to = out + (size_t)y * w;
        for (size_t x = 0; x < w; x++) to[x] = k[0] * padded[x];
        for (int j = 1; j < FS_WINDOW_SIZE; j++)
            for (size_t x = 0; x < w; x++) to[x] += k[j] * padded[x + (size_t)j];
    }
}

WindowSums fs_window_compare(const double *a, const double *b, int width, int height, int margin, double *scratch)
{
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    size_t w = (size_t)width, n = w * (size_t)height;
    double *average[5], *product = scratch + 5 * n, *row = scratch + 6 * n;
    for (size_t i = 0; i < 5; i++) average[i] = scratch + i * n;
    filter(a, width, height, average[0], row);
    filter(b, width, height, average[1], row);
    const double *x[3] = {a, b, a}, *y[3] = {a, b, b};
    for (int m = 0; m < 3; m++) {
        for (size_t i = 0; i < n; i++) product[i] = x[m][i] * y[m][i];
        filter(product, width, height, average[2 + m], row);
    }
    WindowSums sums = {0};
    for (int v = margin; v < height - margin; v++)
        for (size_t i = (size_t)v * w + (size_t)margin; i < ((size_t)v + 1) * w - (size_t)margin; i++) {
            double ma = average[0][i], mb = average[1][i];
            double va = average[2][i] - ma * ma, vb = average[3][i] - mb * mb, vab = average[4][i] - ma * mb;
            double contrast = (2 * vab + c2) / (va + vb + c2);
            sums.contrast += contrast;
            sums.ssim += (2 * ma * mb + c1) / (ma * ma + mb * mb + c1) * contrast;
            sums.pixels++;
        }
    return sums;
}

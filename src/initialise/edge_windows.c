#include "initialise/edge_windows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef float Four __attribute__((vector_size(16)));

enum { AROUND = 2 * SWEEP_SLOW_SIGMA_T }; // pixels that the slow part reaches

static bool trusted(const float rgb[3])
{
    return isfinite(rgb[0] + rgb[1] + rgb[2]);
}

// Linear light -> where colours are compared: (height, width, 3).
static float *tones_of(const Image *photo)
{
    size_t n = 3 * fs_image_pixels(photo);
    float *tone = malloc(sizeof *tone * (n + 1));
    for (size_t i = 0; tone && i < n; i++)
        tone[i] = isfinite(photo->px[i]) ? powf(fmaxf(photo->px[i], 0), EDGE_TONE) : 0;
    return tone;
}

static float difference2(const float a[3], const float b[3])
{
    float r = a[0] - b[0], g = a[1] - b[1], d = a[2] - b[2];
    return r * r + g * g + d * d;
}

// The mean over like pixels around one; the pixel itself is trusted.
static void slow_at(const Image *photo, const float *tone, const float *near, int x, int y, float mean[3])
{
    int x0 = x < AROUND ? 0 : x - AROUND, x1 = x + AROUND >= photo->width ? photo->width - 1 : x + AROUND;
    int y0 = y < AROUND ? 0 : y - AROUND, y1 = y + AROUND >= photo->height ? photo->height - 1 : y + AROUND;
    const float *own = tone + 3 * ((size_t)y * (size_t)photo->width + (size_t)x);
    float sum[4] = {0};
    for (int v = y0; v <= y1; v++)
        for (int u = x0; u <= x1; u++) {
            size_t at = 3 * ((size_t)v * (size_t)photo->width + (size_t)u);
            const float *rgb = photo->px + at;
            if (!trusted(rgb)) continue;
            float unlike = difference2(tone + at, own) / (EDGE_RANGE * EDGE_RANGE);
            float weight = near[abs(u - x)] * near[abs(v - y)] * expf(-unlike / 2);
            for (int c = 0; c < 3; c++) sum[c] += weight * rgb[c];
            sum[3] += weight;
        }
    for (int c = 0; c < 3; c++) mean[c] = sum[c] / sum[3];
}

int fs_edge_windows_fine(const Image *photo, Image *fine, FsError *err)
{
    float *tone = NULL, near[AROUND + 1];
    int rc = 0;
    TRY(fs_image_new(fine, photo->width, photo->height, 4, err));
    if (!(tone = tones_of(photo))) TRY(fs_error_memory(err));
    for (int k = 0; k <= AROUND; k++) near[k] = expf(-(float)(k * k) / (2 * SWEEP_SLOW_SIGMA_T * SWEEP_SLOW_SIGMA_T));
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++) {
            const float *rgb = fs_image_at(photo, x, y);
            float *out = fs_image_at(fine, x, y), mean[3];
            if (!trusted(rgb)) continue;
            slow_at(photo, tone, near, x, y, mean);
            for (int c = 0; c < 3; c++) out[c] = rgb[c] - mean[c];
            out[3] = 1;
        }
fail:
    free(tone);
    return rc;
}

// ---- windows ----

void fs_edge_windows_free(EdgeWindows *windows)
{
    free(windows->weight);
    *windows = (EdgeWindows){0};
}

static void fill_window(const EdgeWindows *w, const float *tone, int x, int y)
{
    const float *own = tone + 3 * (y * w->width + x);
    float *weight = w->weight + (size_t)(y * w->width + x) * EDGE_SIDE * EDGE_SIDE, sum = 0;
    for (int k = 0; k < EDGE_SIDE * EDGE_SIDE; k++) {
        int dx = k % EDGE_SIDE - SWEEP_BLUR_RADIUS, dy = k / EDGE_SIDE - SWEEP_BLUR_RADIUS, u = x + dx, v = y + dy;
        weight[k] = 0;
        if (u < 0 || v < 0 || u >= w->width || v >= w->height) continue;
        const float *other = tone + 3 * (v * w->width + u);
        float unlike = fabsf(other[0] - own[0]) + fabsf(other[1] - own[1]) + fabsf(other[2] - own[2]);
        float far = (float)(dx * dx + dy * dy) / (2 * SWEEP_WINDOW_SIGMA * SWEEP_WINDOW_SIGMA);
        weight[k] = expf(-far - unlike / (3 * EDGE_LIKE));
        if (weight[k] < EDGE_LEAST) weight[k] = 0;
        sum += weight[k];
    }
    for (int k = 0; k < EDGE_SIDE * EDGE_SIDE; k++) weight[k] /= sum;
}

int fs_edge_windows_new(const Image *photo, int width, int height, EdgeWindows *windows, FsError *err)
{
    Image known = {0}, small = {0};
    float *tone = NULL;
    int rc = 0;
    *windows =
        (EdgeWindows){width, height, malloc(sizeof(float) * (size_t)width * (size_t)height * EDGE_SIDE * EDGE_SIDE)};
    if (!windows->weight) TRY(fs_error_memory(err));
    TRY(fs_image_copy(&known, photo, err));
    for (size_t i = 0; i < fs_image_values(&known); i++) // what is not to be trusted is mostly clipped
        if (!isfinite(known.px[i])) known.px[i] = 1;
    TRY(fs_image_resize_area(&known, width, height, &small, err));
    if (!(tone = tones_of(&small))) TRY(fs_error_memory(err));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) fill_window(windows, tone, x, y);
fail:
    fs_image_free(&known);
    fs_image_free(&small);
    free(tone);
    if (rc < 0) fs_edge_windows_free(windows);
    return rc;
}

void fs_edge_windows_sum(const EdgeWindows *w, const float *values, float *sums)
{
    const float *weight = w->weight;
    for (int y = 0; y < w->height; y++)
        for (int x = 0; x < w->width; x++) {
            Four sum[EDGE_VALUES / 4] = {0};
            for (int k = 0; k < EDGE_SIDE * EDGE_SIDE; k++) {
                if (!(weight[k] > 0)) continue;
                int u = x + k % EDGE_SIDE - SWEEP_BLUR_RADIUS, v = y + k / EDGE_SIDE - SWEEP_BLUR_RADIUS;
                const Four *other = (const Four *)(values + (size_t)(v * w->width + u) * EDGE_VALUES);
                for (int c = 0; c < EDGE_VALUES / 4; c++) sum[c] += weight[k] * other[c];
            }
            memcpy(sums, sum, sizeof sum);
            sums += EDGE_VALUES;
            weight += EDGE_SIDE * EDGE_SIDE;
        }
}

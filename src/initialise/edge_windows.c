#include "initialise/edge_windows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"

typedef float Four __attribute__((vector_size(16)));

enum { AROUND = 2 * SWEEP_SLOW_SIGMA_T }; // pixels that the slow part reaches

static float tone_of(float light)
{
    return isfinite(light) ? powf(fmaxf(light, 0), EDGE_TONE) : 0;
}

// A photo's channels apart, each (height, width).
typedef struct Planes {
    Arena arena;
    float *light[3], *tone[3], *trust; // light 0 where not to be trusted, trust 1 or 0
    float *sum[4];                     // of a row: weighted light, weights
} Planes;

static int planes_of(const Image *photo, Planes *p, FsError *err)
{
    size_t n = fs_image_pixels(photo);
    *p = (Planes){.trust = NULL};
    for (int c = 0; c < 3; c++) {
        p->light[c] = ARENA_NEW(&p->arena, float, n);
        p->tone[c] = ARENA_NEW(&p->arena, float, n);
    }
    p->trust = ARENA_NEW(&p->arena, float, n);
    for (int c = 0; c < 4; c++) p->sum[c] = ARENA_NEW(&p->arena, float, photo->width);
    if (p->arena.failed) return fs_error_memory(err);
    for (size_t i = 0; i < n; i++) {
        const float *rgb = photo->px + 3 * i;
        bool trusted = isfinite(rgb[0] + rgb[1] + rgb[2]);
        p->trust[i] = trusted;
        for (int c = 0; c < 3; c++) {
            p->light[c][i] = trusted ? rgb[c] : 0;
            p->tone[c][i] = tone_of(rgb[c]);
        }
    }
    return 0;
}

// Adds what lies (dx, dy) beside each pixel of row y, by how alike it is: about exp(-d^2 / 2 range^2).
static void add_beside(const Planes *p, int width, int y, int dx, int dy, float near)
{
    int from = dx < 0 ? -dx : 0, to = dx > 0 ? width - dx : width;
    size_t own = (size_t)y * (size_t)width;
    ptrdiff_t beside = (ptrdiff_t)dy * width + dx;
    const float *restrict t0 = p->tone[0] + own, *restrict t1 = p->tone[1] + own, *restrict t2 = p->tone[2] + own;
    const float *restrict l0 = p->light[0] + own, *restrict l1 = p->light[1] + own, *restrict l2 = p->light[2] + own;
    const float *restrict trust = p->trust + own;
    float *restrict s0 = p->sum[0], *restrict s1 = p->sum[1], *restrict s2 = p->sum[2], *restrict s3 = p->sum[3];
    for (ptrdiff_t x = from; x < to; x++) {
        float a = t0[x + beside] - t0[x], b = t1[x + beside] - t1[x], c = t2[x + beside] - t2[x];
        float unlike = (a * a + b * b + c * c) / (2 * EDGE_RANGE * EDGE_RANGE);
        float weight = near * trust[x + beside] / (1 + unlike * (1 + unlike * (0.5f + unlike * (1 / 6.0f))));
        s0[x] += weight * l0[x + beside];
        s1[x] += weight * l1[x + beside];
        s2[x] += weight * l2[x + beside];
        s3[x] += weight;
    }
}

static void fine_row(const Planes *p, int width, int height, int y, Image *fine)
{
    for (int c = 0; c < 4; c++) memset(p->sum[c], 0, sizeof(float) * (size_t)width);
    for (int dy = -AROUND; dy <= AROUND; dy++)
        for (int dx = -AROUND; dx <= AROUND && y + dy >= 0 && y + dy < height; dx++)
            add_beside(p, width, y, dx, dy,
                       expf(-(float)(dx * dx + dy * dy) / (2 * SWEEP_SLOW_SIGMA_T * SWEEP_SLOW_SIGMA_T)));
    for (int x = 0; x < width; x++) {
        size_t i = (size_t)y * (size_t)width + (size_t)x;
        float *out = fs_image_at(fine, x, y);
        if (!(p->trust[i] > 0)) continue;
        for (int c = 0; c < 3; c++) out[c] = p->light[c][i] - p->sum[c][x] / p->sum[3][x];
        out[3] = 1;
    }
}

int fs_edge_windows_fine(const Image *photo, Image *fine, FsError *err)
{
    Planes planes = {.trust = NULL};
    int rc = 0;
    TRY(fs_image_new(fine, photo->width, photo->height, 4, err));
    TRY(planes_of(photo, &planes, err));
    for (int y = 0; y < photo->height; y++) fine_row(&planes, photo->width, photo->height, y, fine);
fail:
    fs_arena_free(&planes.arena);
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
    int rc = 0;
    *windows =
        (EdgeWindows){width, height, malloc(sizeof(float) * (size_t)width * (size_t)height * EDGE_SIDE * EDGE_SIDE)};
    if (!windows->weight) TRY(fs_error_memory(err));
    TRY(fs_image_copy(&known, photo, err));
    for (size_t i = 0; i < fs_image_values(&known); i++) // what is not to be trusted is mostly clipped
        if (!isfinite(known.px[i])) known.px[i] = 1;
    TRY(fs_image_resize_area(&known, width, height, &small, err));
    for (size_t i = 0; i < fs_image_values(&small); i++) small.px[i] = tone_of(small.px[i]);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) fill_window(windows, small.px, x, y);
fail:
    fs_image_free(&known);
    fs_image_free(&small);
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
                Four other[EDGE_VALUES / 4];
                memcpy(other, values + (size_t)(v * w->width + u) * EDGE_VALUES, sizeof other);
                for (int c = 0; c < EDGE_VALUES / 4; c++) sum[c] += weight[k] * other[c];
            }
            memcpy(sums, sum, sizeof sum);
            sums += EDGE_VALUES;
            weight += EDGE_SIDE * EDGE_SIDE;
        }
}

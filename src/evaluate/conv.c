// Convolution as a matrix product: output (M channels, P pixels) = weight (M, K) * patches (K, P), K = in * kernel^2.
// Pixels are cut into jobs of BLOCK, K into slices that fit the caches; within a slice, tiles of ROWS x COLS outputs
// are summed in registers. The order of the sums depends on the shapes alone.
#include "evaluate/conv.h"

#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/cpu.h"

#define ROWS 6
#define COLS 16
#define BLOCK 96 // pixels per job
#define SLICE 256

int fs_conv_maps_new(Maps *maps, int channels, int height, int width, FsError *err)
{
    *maps = (Maps){channels, height, width, calloc((size_t)channels * (size_t)height * (size_t)width, sizeof(float))};
    return maps->px ? 0 : fs_error_memory(err);
}

void fs_conv_maps_free(Maps *maps)
{
    free(maps->px);
    *maps = (Maps){0};
}

int fs_conv_side(const ConvShape *shape, int side)
{
    int room = side + 2 * shape->pad - shape->kernel;
    return room < 0 ? 0 : room / shape->stride + 1;
}

// ---- one tile: sum (ROWS, COLS) += a (n, ROWS) * b (n, COLS) ----

typedef void TileFunction(const float *a, const float *b, size_t n, float *sum);

static void tile_plain(const float *a, const float *b, size_t n, float *sum)
{
    float s[ROWS][COLS];
    memcpy(s, sum, sizeof s);
    for (size_t k = 0; k < n; k++, a += ROWS, b += COLS)
#pragma GCC unroll 6
        for (int r = 0; r < ROWS; r++)
#pragma GCC unroll 16
            for (int c = 0; c < COLS; c++) s[r][c] += a[r] * b[c];
    memcpy(sum, s, sizeof s);
}

#if defined(__x86_64__)
#include <immintrin.h>

__attribute__((target("avx2,fma"))) static void tile_avx2(const float *a, const float *b, size_t n, float *sum)
{
    __m256 s[ROWS][2];
#pragma GCC unroll 6
    for (int r = 0; r < ROWS; r++) {
        s[r][0] = _mm256_loadu_ps(sum + r * COLS);
        s[r][1] = _mm256_loadu_ps(sum + r * COLS + 8);
    }
    for (size_t k = 0; k < n; k++, a += ROWS, b += COLS) {
        __m256 b0 = _mm256_loadu_ps(b), b1 = _mm256_loadu_ps(b + 8);
#pragma GCC unroll 6
        for (int r = 0; r < ROWS; r++) {
            __m256 w = _mm256_broadcast_ss(a + r);
            s[r][0] = _mm256_fmadd_ps(w, b0, s[r][0]);
            s[r][1] = _mm256_fmadd_ps(w, b1, s[r][1]);
        }
    }
#pragma GCC unroll 6
    for (int r = 0; r < ROWS; r++) {
        _mm256_storeu_ps(sum + r * COLS, s[r][0]);
        _mm256_storeu_ps(sum + r * COLS + 8, s[r][1]);
    }
}
#endif

static TileFunction *tile_choose(void)
{
#if defined(__x86_64__)
    if (fs_cpu_has(CPU_AVX2)) return tile_avx2;
#endif
    return tile_plain;
}

// ---- the product, one block of pixels per job ----

typedef struct Product {
    const ConvShape *shape;
    const float *packed; // weights: (K slice by slice, panels of ROWS rows, k, ROWS), short panels filled with 0
    const float *bias;
    const float *padded; // (in, height, width) of the input with its border of zeros
    size_t width, plane; // of padded
    const size_t *tap;   // (K): where a patch's element lies, from the patch's corner
    Maps *out;
    size_t k, panels;
    TileFunction *tile;
    float *scratch; // per worker
    size_t scratch_size;
} Product;

static size_t corner(const Product *p, size_t pixel) // of the patch of an output pixel, in a padded plane
{
    size_t w = (size_t)p->out->width, stride = (size_t)p->shape->stride;
    return pixel / w * stride * p->width + pixel % w * stride;
}

// patches (columns of COLS pixels, n, COLS) of K's elements k0 .. k0 + n - 1; pixels past the last repeat it.
static void gather(const Product *p, size_t pixel0, size_t pixels, size_t k0, size_t n, float *patches)
{
    size_t w = (size_t)p->out->width, columns = (pixels + COLS - 1) / COLS;
    for (size_t column = 0; column < columns; column++) {
        size_t first = pixel0 + column * COLS, at[COLS];
        for (size_t c = 0; c < COLS; c++) {
            size_t pixel = first + c < pixel0 + pixels ? first + c : pixel0 + pixels - 1;
            at[c] = corner(p, pixel);
        }
        bool run = p->shape->stride == 1 && first % w + COLS <= w && column * COLS + COLS <= pixels;
        float *to = patches + column * n * COLS;
        for (size_t k = 0; k < n; k++, to += COLS) {
            const float *from = p->padded + p->tap[k0 + k];
            if (run)
                memcpy(to, from + at[0], sizeof(float) * COLS);
            else
                for (size_t c = 0; c < COLS; c++) to[c] = from[at[c]];
        }
    }
}

static void store(const Product *p, const float *sums, size_t pixel0, size_t pixels)
{
    size_t all = (size_t)p->out->height * (size_t)p->out->width;
    for (size_t m = 0; m < (size_t)p->shape->out; m++)
        for (size_t i = 0; i < pixels; i++) {
            size_t column = i / COLS;
            float v = sums[((column * p->panels + m / ROWS) * ROWS + m % ROWS) * COLS + i % COLS] + p->bias[m];
            p->out->px[m * all + pixel0 + i] = v > 0 ? v : 0;
        }
}

static void product_job(void *context, int job, int worker)
{
    const Product *p = context;
    size_t all = (size_t)p->out->height * (size_t)p->out->width, pixel0 = (size_t)job * BLOCK;
    size_t pixels = all - pixel0 < BLOCK ? all - pixel0 : BLOCK, columns = (pixels + COLS - 1) / COLS;
    float *patches = p->scratch + (size_t)worker * p->scratch_size, *sums = patches + SLICE * BLOCK;
    memset(sums, 0, sizeof(float) * p->panels * ROWS * columns * COLS);
    for (size_t k0 = 0; k0 < p->k; k0 += SLICE) {
        size_t n = p->k - k0 < SLICE ? p->k - k0 : SLICE;
        gather(p, pixel0, pixels, k0, n, patches);
        for (size_t panel = 0; panel < p->panels; panel++)
            for (size_t column = 0; column < columns; column++)
                p->tile(p->packed + k0 * p->panels * ROWS + panel * n * ROWS, patches + column * n * COLS, n,
                        sums + (column * p->panels + panel) * ROWS * COLS);
    }
    store(p, sums, pixel0, pixels);
}

static void pack_weights(const float *weight, size_t m, size_t k, size_t panels, float *packed)
{
    for (size_t k0 = 0; k0 < k; k0 += SLICE) {
        size_t n = k - k0 < SLICE ? k - k0 : SLICE;
        for (size_t panel = 0; panel < panels; panel++)
            for (size_t i = 0; i < n; i++)
                for (size_t r = 0; r < ROWS; r++) {
                    size_t row = panel * ROWS + r;
                    packed[k0 * panels * ROWS + (panel * n + i) * ROWS + r] = row < m ? weight[row * k + k0 + i] : 0;
                }
    }
}

static void pad_maps(const Maps *in, int pad, float *padded)
{
    size_t w = (size_t)(in->width + 2 * pad), h = (size_t)(in->height + 2 * pad);
    for (size_t c = 0; c < (size_t)in->channels; c++)
        for (size_t y = 0; y < (size_t)in->height; y++)
            memcpy(padded + (c * h + y + (size_t)pad) * w + (size_t)pad,
                   in->px + (c * (size_t)in->height + y) * (size_t)in->width, sizeof(float) * (size_t)in->width);
}

int fs_conv_relu(const ConvShape *shape, const float *weight, const float *bias, const Maps *in, Maps *out,
                 Threads *threads, FsError *err)
{
    size_t taps = (size_t)(shape->kernel * shape->kernel), kernel = (size_t)shape->kernel;
    size_t width = (size_t)(in->width + 2 * shape->pad), plane = width * (size_t)(in->height + 2 * shape->pad);
    MUST(fs_conv_maps_new(out, shape->out, fs_conv_side(shape, in->height), fs_conv_side(shape, in->width), err));
    int rc = 0;
    Product p = {.shape = shape, .bias = bias, .out = out, .width = width, .plane = plane, .tile = tile_choose()};
    p.k = (size_t)shape->in * taps;
    p.panels = ((size_t)shape->out + ROWS - 1) / ROWS;
    p.scratch_size = SLICE * BLOCK + p.panels * ROWS * BLOCK;
    Arena arena = {0};
    size_t n_packed = p.panels * ROWS * p.k, n_scratch = p.scratch_size * (size_t)fs_threads_count(threads);
    size_t n_padded = (size_t)shape->in * plane, *tap = ARENA_NEW(&arena, size_t, p.k);
    float *packed = ARENA_NEW(&arena, float, n_packed);
    p.scratch = ARENA_NEW(&arena, float, n_scratch);
    float *padded = ARENA_NEW(&arena, float, n_padded);
    if (arena.failed) TRY(fs_error_memory(err));
    memset(padded, 0, sizeof(float) * n_padded);
    pad_maps(in, shape->pad, padded);
    pack_weights(weight, (size_t)shape->out, p.k, p.panels, packed);
    for (size_t k = 0; k < p.k; k++) tap[k] = k / taps * plane + k / kernel % kernel * width + k % kernel;
    p.padded = padded, p.packed = packed, p.tap = tap;
    size_t all = (size_t)out->height * (size_t)out->width;
    fs_threads_for(threads, (int)((all + BLOCK - 1) / BLOCK), product_job, &p);
fail:
    fs_arena_free(&arena);
    if (rc < 0) fs_conv_maps_free(out);
    return rc;
}

int fs_conv_max_pool(const Maps *in, int size, Maps *out, FsError *err)
{
    int height = in->height < size ? 0 : (in->height - size) / 2 + 1;
    int width = in->width < size ? 0 : (in->width - size) / 2 + 1;
    MUST(fs_conv_maps_new(out, in->channels, height, width, err));
    for (int c = 0; c < in->channels; c++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                const float *from =
                    in->px + ((size_t)c * (size_t)in->height + (size_t)(2 * y)) * (size_t)in->width + 2 * x;
                float most = *from;
                for (int v = 0; v < size; v++)
                    for (int u = 0; u < size; u++) {
                        float value = from[(size_t)v * (size_t)in->width + (size_t)u];
                        most = value > most ? value : most;
                    }
                out->px[((size_t)c * (size_t)height + (size_t)y) * (size_t)width + (size_t)x] = most;
            }
    return 0;
}

#include "model/look.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "image/blur.h"

#define FINE_SIGMA 0.7f // pixels
#define COARSE_SIGMA 2.0f
#define GREY 0.003f       // colour as a share of the light: rounding's
#define LEAST_ENERGY 1e-8 // of what has no structure at all

// Of second differences along a direction.
static double energy(const float *px, int width, int height, int dx, int dy)
{
    double sum = 0;
    for (int y = 1; y < height - 1; y++) {
        const float *row = px + (size_t)y * (size_t)width;
        long step = (long)dy * width + dx;
        for (int x = 1; x < width - 1; x++) {
            float d = 2 * row[x] - row[x + step] - row[x - step];
            sum += (double)d * (double)d;
        }
    }
    return sum / ((double)(width - 2) * (height - 2));
}

// The square root evens out shot noise, and light and shade.
static int make_grey(const Image *rgb, Image *grey, Look *look, FsError *err)
{
    Image small = {0};
    int width = rgb->width, height = rgb->height, rc = 0;
    fs_image_limit(FS_LOOK_EDGE, &width, &height);
    bool shrink = width < rgb->width || height < rgb->height;
    if (shrink) TRY(fs_image_resize_area(rgb, width, height, &small, err));
    const Image *from = shrink ? &small : rgb;
    TRY(fs_image_new(grey, from->width, from->height, 1, err));
    double mean = 0, color = 0;
    for (size_t i = 0; i < fs_image_pixels(from); i++) {
        float r = from->px[3 * i], g = from->px[3 * i + 1], b = from->px[3 * i + 2], v = (r + g + b) / 3;
        mean += (double)v / (double)fs_image_pixels(from);
        color += (double)(fabsf(r - g) + fabsf(b - g)) / (double)fs_image_pixels(from);
        grey->px[i] = sqrtf(fmaxf(v, 1e-4f));
    }
    look->mean = mean;
    look->grey = color < GREY * mean;
fail:
    fs_image_free(&small);
    return rc;
}

void fs_look_free(Look *look)
{
    fs_image_free(&look->small);
    *look = (Look){0};
}

static int make_small(Look *look, const Image *grey, FsError *err)
{
    int width = grey->width, height = grey->height;
    fs_image_free(&look->small);
    look->hash = 0;
    if (width < FS_LOOK_SMALL && height < FS_LOOK_SMALL) return 0; // tells too little
    fs_image_limit(FS_LOOK_SMALL, &width, &height);
    look->hash = fs_hash_bytes(FS_HASH_EMPTY, grey->px, fs_image_pixels(grey) * sizeof *grey->px);
    if (width == grey->width && height == grey->height) return fs_image_copy(&look->small, grey, err);
    return fs_image_resize_area(grey, width, height, &look->small, err);
}

int fs_look_at(Look *look, const Image *rgb, FsError *err)
{
    static const int direction[LOOK_DIRECTIONS][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
    Image grey = {0};
    float *fine = NULL, *coarse = NULL, *scratch = NULL;
    int rc = 0;
    memset(look->detail, 0, sizeof look->detail);
    TRY(make_grey(rgb, &grey, look, err));
    TRY(make_small(look, &grey, err));
    if (grey.width < 16 || grey.height < 16) goto fail; // nothing to see
    size_t n = fs_image_pixels(&grey);
    fine = malloc(n * sizeof *fine);
    coarse = malloc(n * sizeof *coarse);
    scratch = malloc(n * sizeof *scratch);
    if (!fine || !coarse || !scratch) TRY(fs_error_memory(err));
    fs_blur_image(&grey, scratch, fine, FINE_SIGMA);
    fs_blur_image(&grey, scratch, coarse, COARSE_SIGMA);
    for (int k = 0; k < LOOK_DIRECTIONS; k++) {
        int dx = direction[k][0], dy = direction[k][1];
        look->detail[k] = energy(fine, grey.width, grey.height, dx, dy) /
                          (energy(coarse, grey.width, grey.height, dx, dy) + LEAST_ENERGY);
    }
fail:
    free(fine);
    free(coarse);
    free(scratch);
    fs_image_free(&grey);
    return rc;
}

#include "poses/undistort.h"

#include <math.h>
#include <string.h>

#include "image/bicubic.h"

static int clamp(int v, int n)
{
    return v < 0 ? 0 : v >= n ? n - 1 : v;
}

// One pixel of the result. Overshoot is kept within the four pixels around, so that edges of lamps do not ring.
static float sample(const Image *photo, const Image *mask, double x, double y, float *rgb)
{
    int x0 = (int)floor(x - 0.5), y0 = (int)floor(y - 0.5);
    float wx[4], wy[4], trusted = 1;
    fs_bicubic_weights((float)(x - 0.5 - x0), wx);
    fs_bicubic_weights((float)(y - 0.5 - y0), wy);
    for (int c = 0; c < 3; c++) {
        float sum = 0, low = INFINITY, high = -INFINITY;
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++) {
                size_t at = (size_t)clamp(y0 - 1 + j, photo->height) * (size_t)photo->width +
                            (size_t)clamp(x0 - 1 + i, photo->width);
                float v = photo->px[3 * at + (size_t)c];
                sum += wx[i] * wy[j] * v;
                if (i == 0 || i == 3 || j == 0 || j == 3) continue;
                low = fminf(low, v);
                high = fmaxf(high, v);
                if (c == 0 && mask->px[at] < 0.5f) trusted = 0;
            }
        rgb[c] = fminf(fmaxf(sum, low), high);
    }
    return trusted;
}

int fs_undistort(const Lens *lens, const Camera *camera, Image *photo, Image *mask, FsError *err)
{
    Image from = {0}, from_mask = {0};
    int rc = 0;
    TRY(fs_image_copy(&from, photo, err));
    TRY(fs_image_copy(&from_mask, mask, err));
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++) {
            double ray[2] = {(x + 0.5 - camera->cx) / camera->fx, (y + 0.5 - camera->cy) / camera->fy}, p[2];
            size_t at = (size_t)y * (size_t)photo->width + (size_t)x;
            fs_lens_project(lens, ray, p);
            bool inside = p[0] >= 0 && p[1] >= 0 && p[0] <= photo->width && p[1] <= photo->height; // false for NaN
            mask->px[at] = inside ? sample(&from, &from_mask, p[0], p[1], photo->px + 3 * at) : 0;
            if (!inside) memset(photo->px + 3 * at, 0, 3 * sizeof(float));
        }
fail:
    fs_image_free(&from);
    fs_image_free(&from_mask);
    return rc;
}

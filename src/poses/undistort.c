#include "poses/undistort.h"

#include <math.h>
#include <string.h>

#define TAPS 6 // Lanczos's kernel of three lobes: bicubic weights would take a tenth of the fine contrast

static int clamp(int v, int n)
{
    return v < 0 ? 0 : v >= n ? n - 1 : v;
}

// Weights of the samples j from -2 to 3 at a place t from 0 to 1, whose sum is 1: sinc(t - j) sinc((t - j) / 3).
static void lanczos(double t, float w[TAPS])
{
    static const double cosine[TAPS] = {-0.5, 0.5, 1, 0.5, -0.5, -1}, // of j pi / 3
        sine[TAPS] = {-0.86602540378443865, -0.86602540378443865, 0, 0.86602540378443865, 0.86602540378443865, 0};
    double sine_t = sin(M_PI * t), sine_third = sin(M_PI / 3 * t), cosine_third = cos(M_PI / 3 * t), sum = 0, at[TAPS];
    for (int k = 0; k < TAPS; k++) {
        double d = t - (k - 2), wide = sine_third * cosine[k] - cosine_third * sine[k]; // sin((t - j) pi / 3)
        at[k] = fabs(d) < 1e-6 ? 1 : (k % 2 ? -sine_t : sine_t) * wide * 3 / (M_PI * M_PI * d * d);
        sum += at[k];
    }
    for (int k = 0; k < TAPS; k++) w[k] = (float)(at[k] / sum);
}

// One pixel of the result. Overshoot is kept within the 16 pixels around, so that edges of lamps do not ring.
static float sample(const Image *photo, const Image *mask, double x, double y, float *rgb)
{
    int x0 = (int)floor(x - 0.5), y0 = (int)floor(y - 0.5);
    float wx[TAPS], wy[TAPS], trusted = 1, low[3], high[3], sum[3] = {0};
    lanczos(x - 0.5 - x0, wx);
    lanczos(y - 0.5 - y0, wy);
    for (int c = 0; c < 3; c++) low[c] = INFINITY, high[c] = -INFINITY;
    for (int j = 0; j < TAPS; j++)
        for (int i = 0; i < TAPS; i++) {
            int u = clamp(x0 - 2 + i, photo->width), v = clamp(y0 - 2 + j, photo->height);
            const float *px = fs_image_at(photo, u, v);
            bool near = i > 0 && i < TAPS - 1 && j > 0 && j < TAPS - 1;
            for (int c = 0; c < 3; c++) {
                sum[c] += wx[i] * wy[j] * px[c];
                if (near) low[c] = fminf(low[c], px[c]), high[c] = fmaxf(high[c], px[c]);
            }
            bool next = (i == 2 || i == 3) && (j == 2 || j == 3);
            if (next) trusted = fminf(trusted, *fs_image_at(mask, u, v));
        }
    for (int c = 0; c < 3; c++) rgb[c] = fminf(fmaxf(sum[c], low[c]), high[c]);
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

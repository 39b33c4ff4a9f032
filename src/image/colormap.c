#include "image/colormap.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"
#include "image/profile.h"
#include "image/tone.h"

// Inverse of CIELAB's f.
static double lab_inverse(double t)
{
    return t > 6.0 / 29 ? t * t * t : 3 * (6.0 / 29) * (6.0 / 29) * (t - 4.0 / 29);
}

static void lab_to_srgb(double l, double a, double b, float rgb[3])
{
    double fy = (l + 16) / 116;
    const double xyz[3] = {0.95047 * lab_inverse(fy + a / 500), lab_inverse(fy), 1.08883 * lab_inverse(fy - b / 200)};
    for (int c = 0; c < 3; c++) {
        float v = fs_tone_srgb_encode((float)fmax(v3_dot(fs_profile_srgb_from_xyz + 3 * c, xyz), 0));
        rgb[c] = v > 1 ? 1 : v;
    }
}

void fs_colormap_color(float value, float rgb[3])
{
    double t = value > 0 ? (value < 1 ? value : 1) : 0; // NaN becomes 0
    double lightness = 14 + 76 * t;                     // even steps
    double hue = (310 - 210 * t) * M_PI / 180;          // violet, blue, green, yellow
    double chroma = 30 + 62 * t * t * t * t;
    lab_to_srgb(lightness, chroma * cos(hue), chroma * sin(hue), rgb);
}

bool fs_colormap_range(const Image *image, double low, double high, float *low_value, float *high_value)
{
    size_t n = fs_image_values(image), kept = 0;
    float *values = malloc(sizeof *values * (n ? n : 1));
    if (!values) {
        fs_error_memory(NULL);
        return false;
    }
    for (size_t i = 0; i < n; i++)
        if (image->px[i] > 0 && isfinite(image->px[i])) values[kept++] = image->px[i];
    if (kept) {
        fs_order_floats(values, kept);
        *low_value = values[(size_t)(low * (double)(kept - 1) + 0.5)];
        *high_value = values[(size_t)(high * (double)(kept - 1) + 0.5)];
    }
    free(values);
    return kept > 0;
}

int fs_colormap_depth(const Image *depth, float nearest, float farthest, Image *picture, FsError *err)
{
    MUST(fs_image_new(picture, depth->width, depth->height, 3, err));
    float far_inverse = farthest > 0 ? 1 / farthest : 0, span = nearest > 0 ? 1 / nearest - far_inverse : 0;
    for (size_t i = 0; i < fs_image_pixels(depth); i++) {
        float z = depth->px[i * (size_t)depth->channels], *rgb = picture->px + 3 * i;
        if (z > 0 && isfinite(z))
            fs_colormap_color(span > 0 ? (1 / z - far_inverse) / span : 0.5f, rgb);
        else
            rgb[0] = rgb[1] = rgb[2] = 0.15f;
    }
    return 0;
}

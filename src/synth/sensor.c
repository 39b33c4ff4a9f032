// Shot noise and read noise as Gaussians; demosaicing by linear interpolation with gradient correction
// (Malvar, He, Cutler 2004).
#include "synth/sensor.h"

#include <stdlib.h>

#define FULL_WELL 14000.0f // electrons at SENSOR_WHITE, ISO 200
#define READ_NOISE 4.0f    // electrons

static const float neutral[3] = SENSOR_NEUTRAL;

void fs_sensor_mosaic_free(Mosaic *mosaic)
{
    free(mosaic->px);
    *mosaic = (Mosaic){0};
}

static int bayer_color(int x, int y) // RGGB
{
    return (y & 1) + (x & 1);
}

int fs_sensor_expose(const Image *linear, int iso, Rng rng, Mosaic *mosaic, FsError *err)
{
    int w = linear->width, h = linear->height;
    float full = FULL_WELL * 200 / (float)iso;
    *mosaic = (Mosaic){w, h, malloc((size_t)w * (size_t)h * sizeof *mosaic->px)};
    if (!mosaic->px) return fs_error_memory(err);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            int c = bayer_color(x, y);
            float electrons = linear->px[((size_t)y * (size_t)w + (size_t)x) * 3 + (size_t)c] * neutral[c] * full;
            electrons = electrons < 0 ? 0 : electrons;
            electrons += sqrtf(electrons + READ_NOISE * READ_NOISE) * fs_rng_normal(&rng);
            float value = SENSOR_BLACK + electrons / full * (SENSOR_WHITE - SENSOR_BLACK) + 0.5f;
            mosaic->px[(size_t)y * (size_t)w + (size_t)x] = (uint16_t)(value < 0              ? 0
                                                                       : value > SENSOR_WHITE ? SENSOR_WHITE
                                                                                              : value);
        }
    return 0;
}

static int mirror(int i, int n) // keeps the colour of the mosaic
{
    i = i < 0 ? -i : i;
    return i >= n ? 2 * n - 2 - i : i;
}

// The 5x5 neighbourhood as sums of places that are alike.
typedef struct Around {
    float centre, cross, far_x, far_y, side_x, side_y, corner;
} Around;

static Around look_around(const Mosaic *m, int x, int y)
{
    float v[5][5];
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 5; i++)
            v[j][i] = (float)m->px[(size_t)mirror(y + j - 2, m->height) * (size_t)m->width +
                                   (size_t)mirror(x + i - 2, m->width)] -
                      SENSOR_BLACK;
    Around a = {.centre = v[2][2], .far_x = v[2][0] + v[2][4], .far_y = v[0][2] + v[4][2]};
    a.side_x = v[2][1] + v[2][3];
    a.side_y = v[1][2] + v[3][2];
    a.cross = a.side_x + a.side_y;
    a.corner = v[1][1] + v[1][3] + v[3][1] + v[3][3];
    return a;
}

static void demosaic(const Mosaic *m, int x, int y, float rgb[3])
{
    Around a = look_around(m, x, y);
    float green = (4 * a.centre + 2 * a.cross - a.far_x - a.far_y) / 8;
    float other = (6 * a.centre + 2 * a.corner - 1.5f * (a.far_x + a.far_y)) / 8;
    float along_x = (5 * a.centre + 4 * a.side_x - a.corner - a.far_x + 0.5f * a.far_y) / 8;
    float along_y = (5 * a.centre + 4 * a.side_y - a.corner - a.far_y + 0.5f * a.far_x) / 8;
    switch ((y & 1) * 2 + (x & 1)) {
    case 0: rgb[0] = a.centre, rgb[1] = green, rgb[2] = other; break;
    case 1: rgb[0] = along_x, rgb[1] = a.centre, rgb[2] = along_y; break;
    case 2: rgb[0] = along_y, rgb[1] = a.centre, rgb[2] = along_x; break;
    default: rgb[0] = other, rgb[1] = green, rgb[2] = a.centre; break;
    }
}

double fs_sensor_clipped(const Mosaic *mosaic)
{
    size_t n = (size_t)mosaic->width * (size_t)mosaic->height, full = 0;
    for (size_t i = 0; i < n; i++) full += mosaic->px[i] >= SENSOR_WHITE;
    return (double)full / (double)n;
}

int fs_sensor_develop(const Mosaic *mosaic, const float balance[3], const CameraStyle *style, Image *image,
                      FsError *err)
{
    MUST(fs_image_new(image, mosaic->width, mosaic->height, 3, err));
    for (int y = 0; y < mosaic->height; y++)
        for (int x = 0; x < mosaic->width; x++) {
            float *p = fs_image_at(image, x, y);
            demosaic(mosaic, x, y, p);
            for (int c = 0; c < 3; c++) {
                float linear = p[c] / (SENSOR_WHITE - SENSOR_BLACK) / neutral[c] * balance[c];
                p[c] = linear < 0 ? 0 : linear > 1 ? 1 : linear;
            }
        }
    return fs_style_apply(style, image, err);
}

// Cameras lift the middle tones by half a stop to more than one, let the lights roll off (the shoulder), deepen the
// shadows (the toe), and make colours stronger.
#include "synth/style.h"

#include "image/tone.h"

CameraStyle fs_style_draw(float strength, Rng rng)
{
    CameraStyle s = {.own = true};
    s.lift = strength * fs_rng_range(&rng, 0.4f, 1.6f);
    s.contrast = strength * fs_rng_range(&rng, 2.0f, 4.0f);
    s.middle = fs_rng_range(&rng, 0.4f, 0.52f);
    s.sharpen = strength * fs_rng_range(&rng, 0.3f, 0.8f);
    float stronger = strength * fs_rng_range(&rng, 0.03f, 0.15f); // colours
    static const float luma[3] = {0.2126f, 0.7152f, 0.0722f};
    for (int i = 0; i < 3; i++) {
        float sum = 0;
        for (int j = 0; j < 3; j++) {
            float twist = i == j ? 0 : strength * fs_rng_range(&rng, -0.02f, 0.02f);
            s.matrix[3 * i + j] = (i == j ? 1 + stronger : 0) - stronger * luma[j] + twist;
            sum += s.matrix[3 * i + j];
        }
        s.matrix[3 * i + i] += 1 - sum; // grey stays grey
    }
    return s;
}

static float logistic(float x)
{
    return 1 / (1 + expf(-x));
}

float fs_style_curve(const CameraStyle *s, float light)
{
    light = light < 0 ? 0 : light > 1 ? 1 : light;
    if (!s->own) return fs_tone_srgb_encode(light);
    float v = fs_tone_srgb_encode(light * (1 + s->lift) / (1 + s->lift * light));
    if (s->contrast < 0.01f) return v;
    float black = logistic(-s->contrast * s->middle), white = logistic(s->contrast * (1 - s->middle));
    v = (logistic(s->contrast * (v - s->middle)) - black) / (white - black);
    return v < 0 ? 0 : v > 1 ? 1 : v;
}

static float luma_of(const float p[3])
{
    return 0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2];
}

// Adds to each pixel what its luma has more than the surroundings' (1 2 1 across and down).
static int sharpen(Image *image, float amount, FsError *err)
{
    Image luma = {0};
    MUST(fs_image_new(&luma, image->width, image->height, 1, err));
    for (size_t i = 0; i < fs_image_pixels(image); i++) luma.px[i] = luma_of(image->px + 3 * i);
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            float sum = 0;
            for (int j = -1; j <= 1; j++)
                for (int i = -1; i <= 1; i++) {
                    int u = x + i < 0 || x + i >= image->width ? x : x + i;
                    int v = y + j < 0 || y + j >= image->height ? y : y + j;
                    sum += (float)((2 - i * i) * (2 - j * j)) / 16 * *fs_image_at(&luma, u, v);
                }
            float more = amount * (*fs_image_at(&luma, x, y) - sum), *p = fs_image_at(image, x, y);
            for (int c = 0; c < 3; c++) p[c] = fminf(fmaxf(p[c] + more, 0), 1);
        }
    fs_image_free(&luma);
    return 0;
}

int fs_style_apply(const CameraStyle *s, Image *image, FsError *err)
{
    for (size_t i = 0; i < fs_image_pixels(image); i++) {
        float *p = image->px + 3 * i, in[3] = {p[0], p[1], p[2]};
        for (int c = 0; c < 3; c++) {
            if (s->own) p[c] = s->matrix[3 * c] * in[0] + s->matrix[3 * c + 1] * in[1] + s->matrix[3 * c + 2] * in[2];
            p[c] = fs_style_curve(s, p[c]);
        }
    }
    return s->sharpen > 0 ? sharpen(image, s->sharpen, err) : 0;
}

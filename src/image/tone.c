#include "image/tone.h"

#include <math.h>
#include <string.h>

float fs_tone_encode(float linear)
{
    return linear > 0 ? powf(linear, FS_OPTICS_GAMMA) : 0.0f;
}

float fs_tone_decode(float encoded)
{
    return encoded > 0 ? powf(encoded, 1.0f / FS_OPTICS_GAMMA) : 0.0f;
}

void fs_tone_encode_image(Image *image)
{
    for (size_t i = 0; i < fs_image_values(image); i++) image->px[i] = fs_tone_encode(image->px[i]);
}

void fs_tone_decode_image(Image *image)
{
    for (size_t i = 0; i < fs_image_values(image); i++) image->px[i] = fs_tone_decode(image->px[i]);
}

float fs_tone_srgb_encode(float linear)
{
    if (!(linear > 0)) return 0.0f;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1.0f / 2.4f) - 0.055f;
}

float fs_tone_srgb_decode(float encoded)
{
    if (!(encoded > 0)) return 0.0f;
    return encoded <= 0.04045f ? encoded / 12.92f : powf((encoded + 0.055f) / 1.055f, 2.4f);
}

// Straight up to the knee, then an exponential approach to 1 with the same slope at the knee.
float fs_tone_pleasant(float linear, float exposure)
{
    const float knee = 0.5f;
    float x = linear * exposure;
    if (!(x > 0)) return 0.0f;
    if (x > knee) x = knee + (1 - knee) * (1 - expf(-(x - knee) / (1 - knee)));
    return fs_tone_srgb_encode(x);
}

// The 95th percentile of the brightest channel comes to 0.7 before the shoulder. A histogram over the logarithm
// finds it: 64 bins an octave, from 2^-20 to 2^12.
float fs_tone_pleasant_exposure(const Image *linear_photos, int n)
{
    enum { PER_OCTAVE = 64, LOW = -20, HIGH = 12, BINS = (HIGH - LOW) * PER_OCTAVE };
    int64_t bin[BINS], total = 0, seen = 0;
    memset(bin, 0, sizeof bin);
    for (int i = 0; i < n; i++) {
        const Image *photo = &linear_photos[i];
        size_t c = (size_t)photo->channels;
        for (size_t p = 0; p < fs_image_pixels(photo); p++) {
            float v = 0;
            for (size_t k = 0; k < c; k++) v = fmaxf(v, photo->px[p * c + k]);
            if (!isfinite(v)) continue;
            float at = v > 0 ? (log2f(v) - LOW) * PER_OCTAVE : 0.0f;
            bin[at < 0 ? 0 : at > BINS - 1 ? BINS - 1 : (int)at]++;
            total++;
        }
    }
    if (total == bin[0]) return 1.0f; // nothing but black
    int b = 0;
    for (; b < BINS - 1; b++) {
        seen += bin[b];
        if (seen * 20 >= total * 19) break;
    }
    return 0.7f / exp2f((b + 0.5f) / PER_OCTAVE + LOW);
}

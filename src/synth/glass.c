// Thin sheets of glass: both surfaces of each lumped, inner reflections between two sheets left out.
#include "synth/glass.h"

// Unpolarised Fresnel reflectance of both surfaces of a sheet together.
static float reflectance(float cosine, float n)
{
    float c = fminf(fabsf(cosine), 1.0f), t = sqrtf(1 - (1 - c * c) / (n * n));
    float s = (c - n * t) / (c + n * t), p = (t - n * c) / (t + n * c), one = 0.5f * (s * s + p * p);
    return 2 * one / (1 + one);
}

GlassShare fs_glass_share(const Layout *layout, float refraction, float cosine)
{
    float r = reflectance(cosine, refraction);
    if (layout->gap <= 0) return (GlassShare){r, 0, 1 - r};
    return (GlassShare){r, (1 - r) * (1 - r) * r, (1 - r) * (1 - r)};
}

float fs_glass_refraction(const Layout *layout, float f0)
{
    float sheet = f0; // of one sheet; two mirror r + (1 - r)^2 r
    for (int i = 0; layout->gap > 0 && i < 20; i++)
        sheet -= (sheet * (2 - 2 * sheet + sheet * sheet) - f0) / (2 - 4 * sheet + 3 * sheet * sheet);
    float r = sqrtf(sheet / (2 - sheet));
    return (1 + r) / (1 - r);
}

float fs_glass_dirt(uint32_t seed, float u, float v)
{
    float smear = fmaxf(fs_canvas_noise_at(seed, u / 0.11f, v / 0.16f, 4), 0.0f);            // wiped, not washed
    float touch = fmaxf(fs_canvas_noise_at(seed + 1, u / 0.03f, v / 0.03f, 3) - 0.2f, 0.0f); // fingers
    float speck = fs_canvas_noise_at(seed + 2, u / 0.004f, v / 0.004f, 1) > 0.7f ? 1.0f : 0.0f;
    return 0.27f + 4.0f * smear + 3.3f * touch + 2.7f * speck;
}

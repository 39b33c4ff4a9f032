// The only place where linear light becomes display values and back.
#pragma once

#include "base/optics.h"
#include "image/image.h"

// FS_OPTICS_GAMMA. (The image equation goes on below black: kernels/tone_curve.h.)
float fs_tone_encode(float linear);  // max(linear, 0)^0.22
float fs_tone_decode(float encoded); // max(encoded, 0)^(1/0.22)
void fs_tone_encode_image(Image *image);
void fs_tone_decode_image(Image *image);
float fs_tone_srgb_encode(float linear); // IEC 61966-2-1
float fs_tone_srgb_decode(float encoded);
// For people: exposure, then a filmic shoulder, then sRGB; the same for all layers of a scene.
// exposure: multiplies linear light; see fs_tone_pleasant_exposure.
float fs_tone_pleasant(float linear, float exposure);
float fs_tone_pleasant_exposure(const Image *linear_photos, int n); // from a percentile of the photos

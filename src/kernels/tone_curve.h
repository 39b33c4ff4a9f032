// The tone curve of the image equation as scalar code: see compose.h for what it is below DARK.
#ifndef FS_KERNELS_TONE_CURVE_H
#define FS_KERNELS_TONE_CURVE_H

#include <math.h>

#include "kernels/compose.h"

static inline float tone_decode(float toned)
{
    return toned < FS_COMPOSE_DARK ? toned * FS_COMPOSE_DARK_SLOPE : powf(toned, 1 / FS_COMPOSE_GAMMA);
}
static inline float tone_encode(float linear)
{
    return linear < FS_COMPOSE_DARK_LINEAR ? linear / FS_COMPOSE_DARK_SLOPE : powf(linear, FS_COMPOSE_GAMMA);
}
// Derivatives, from both ends of the curve: linear = decode(toned), toned = encode(linear).
static inline float tone_decode_slope(float toned, float linear)
{
    return toned < FS_COMPOSE_DARK ? FS_COMPOSE_DARK_SLOPE : linear / (toned * FS_COMPOSE_GAMMA);
}
static inline float tone_encode_slope(float linear, float toned)
{
    return linear < FS_COMPOSE_DARK_LINEAR ? 1 / FS_COMPOSE_DARK_SLOPE : toned * FS_COMPOSE_GAMMA / linear;
}

#endif

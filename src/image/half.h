// Numbers of 16 bits, as IEEE 754 has them.
#pragma once

#include <stdint.h>
#include <string.h>

static inline float half_to_float(uint16_t h)
{
    uint32_t sign = (uint32_t)(h & 0x8000) << 16, exponent = (h >> 10) & 31, mantissa = h & 0x3ff, bits;
    float f;
    if (exponent == 0) {
        f = (float)mantissa * 0x1p-24f;
        return sign ? -f : f;
    }
    bits = sign | (exponent == 31 ? 0x7f800000u : (exponent + 112) << 23) | mantissa << 13;
    memcpy(&f, &bits, sizeof f);
    return f;
}

// The nearest, of two the even one; beyond the range the largest.
static inline uint16_t half_from_float(float f)
{
    uint32_t bits;
    if (!(f < 65504) || f < -65504) f = f < 0 ? -65504 : 65504; // NaN too
    memcpy(&bits, &f, sizeof bits);
    uint32_t sign = bits >> 16 & 0x8000, magnitude = bits & 0x7fffffff;
    if (magnitude < 113u << 23) { // below 2^-14: steps of 2^-24
        float scaled = (sign ? -f : f) * 0x1p24f, whole = (float)(int)scaled, rest = scaled - whole;
        uint32_t n = (uint32_t)whole;
        return (uint16_t)(sign | (n + (rest > 0.5f || (rest == 0.5f && n & 1))));
    }
    magnitude -= 112u << 23;
    return (uint16_t)(sign | (magnitude + 0xfff + (magnitude >> 13 & 1)) >> 13);
}

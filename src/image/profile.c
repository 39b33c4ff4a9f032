#include "image/profile.h"

#include <stdint.h>
#include <string.h>

static uint32_t get32(const unsigned char *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

// 'curv' with no entries, or with the gamma 1.0 as its one; 'para' of kind 0 with gamma 1.0.
static bool is_identity(const unsigned char *curve, size_t size)
{
    if (size < 12) return false;
    if (memcmp(curve, "curv", 4) == 0) {
        uint32_t n = get32(curve + 8);
        return n == 0 || (n == 1 && size >= 14 && curve[12] == 1 && curve[13] == 0);
    }
    return memcmp(curve, "para", 4) == 0 && size >= 16 && curve[8] == 0 && curve[9] == 0 &&
           get32(curve + 12) == 0x10000;
}

bool fs_profile_is_linear(const void *icc, size_t size)
{
    const unsigned char *p = icc;
    if (size < 132 || memcmp(p + 36, "acsp", 4) != 0) return false;
    uint32_t n = get32(p + 128);
    for (uint32_t i = 0; i < n && i < 200 && 132 + 12 * ((size_t)i + 1) <= size; i++) {
        const unsigned char *tag = p + 132 + 12 * (size_t)i;
        uint32_t at = get32(tag + 4), length = get32(tag + 8);
        if (memcmp(tag, "rTRC", 4) != 0 && memcmp(tag, "kTRC", 4) != 0) continue;
        return at <= size && length <= size - at && is_identity(p + at, length);
    }
    return false;
}

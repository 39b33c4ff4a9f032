// Small seeded random numbers (PCG32), the same on every machine.
#pragma once

#include <math.h>
#include <stdint.h>

typedef struct Rng {
    uint64_t state;
} Rng;

static inline uint32_t fs_rng_u32(Rng *rng)
{
    uint64_t s = rng->state;
    rng->state = s * 6364136223846793005u + 1442695040888963407u;
    uint32_t x = (uint32_t)(((s >> 18) ^ s) >> 27), r = (uint32_t)(s >> 59);
    return (x >> r) | (x << (-r & 31));
}

static inline Rng fs_rng_new(uint64_t seed)
{
    Rng rng = {seed * 0x9e3779b97f4a7c15u + 0xda3e39cb94b95bdbu};
    fs_rng_u32(&rng);
    return rng;
}

static inline float fs_rng_uniform(Rng *rng) // [0, 1)
{
    return (float)(fs_rng_u32(rng) >> 8) * 0x1p-24f;
}

static inline float fs_rng_range(Rng *rng, float low, float high) // [low, high)
{
    return low + (high - low) * fs_rng_uniform(rng);
}

static inline int fs_rng_below(Rng *rng, int n) // 0 .. n-1
{
    return (int)(((uint64_t)fs_rng_u32(rng) * (uint64_t)n) >> 32);
}

static inline float fs_rng_normal(Rng *rng) // Box-Muller
{
    float u = fs_rng_uniform(rng) + 0x1p-25f, v = fs_rng_uniform(rng);
    return sqrtf(-2.0f * logf(u)) * cosf(6.28318530718f * v);
}

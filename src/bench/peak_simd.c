// Written once for AVX2, AVX-512 and NEON; see kernels/simd.h.
#include "bench/peak.h"
#include "kernels/simd.h"

enum { CHAINS = 12 }; // independent sums: more than latency times width of any core's multiply-add

static float fma_loop(long rounds)
{
    vf sum[CHAINS], a = v_set(0.9999f), b = v_set(1e-4f), all = v_set(0);
    for (int i = 0; i < CHAINS; i++) sum[i] = v_set((float)i);
    for (long r = 0; r < rounds; r++) {
#pragma GCC unroll 12
        for (int i = 0; i < CHAINS; i++) sum[i] = v_fma(sum[i], a, b);
    }
    for (int i = 0; i < CHAINS; i++) all += sum[i];
    return v_sum(all);
}

static void copy_loop(float *to, const float *from, size_t n)
{
    for (size_t i = 0; i < n; i += VW) v_store(to + i, v_load(from + i));
}

const PeakLoops FS_SIMD_SUFFIX(fs_peak) = {fma_loop, 2.0 * CHAINS *VW, copy_loop};

#include "bench/peak.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

enum { CHAINS = 16, COPY_FLOATS = 1 << 24, ROUNDS = 7 };

// Plain C, as the scalar kernels are: the compiler may use what every machine of the architecture has.
static float fma_loop(long rounds)
{
    float sum[CHAINS], all = 0;
    for (int i = 0; i < CHAINS; i++) sum[i] = (float)i;
    for (long r = 0; r < rounds; r++)
        for (int i = 0; i < CHAINS; i++) sum[i] = sum[i] * 0.9999f + 1e-4f;
    for (int i = 0; i < CHAINS; i++) all += sum[i];
    return all;
}

static void copy_loop(float *to, const float *from, size_t n)
{
    memcpy(to, from, n * sizeof *to);
}

static const PeakLoops scalar_loops = {fma_loop, 2.0 * CHAINS, copy_loop};

static const PeakLoops *loops_at(CpuLevel level)
{
    switch (level) {
#if defined(__x86_64__)
    case CPU_AVX2: return &fs_peak_avx2;
    case CPU_AVX512: return &fs_peak_avx512;
#elif defined(__aarch64__)
    case CPU_NEON: return &fs_peak_neon;
#endif
    default: return &scalar_loops;
    }
}

int fs_peak_measure(CpuLevel level, Peak *peak, FsError *err)
{
    const PeakLoops *loops = loops_at(level);
    const long rounds = 2000000;
    volatile float keep = 0;
    *peak = (Peak){0};
    for (int i = 0; i < ROUNDS; i++) { // the best round: a peak is what was reached undisturbed
        double start = fs_clock_of(CLOCK_THREAD_CPUTIME_ID);
        keep = keep + loops->fma(rounds);
        double rate = 1e-9 * loops->flops_per_round * (double)rounds / (fs_clock_of(CLOCK_THREAD_CPUTIME_ID) - start);
        if (rate > peak->fma_gflops) peak->fma_gflops = rate;
    }
    float *memory = aligned_alloc(64, 2 * sizeof(float) * COPY_FLOATS);
    if (!memory) return fs_error_memory(err);
    memset(memory, 1, 2 * sizeof(float) * COPY_FLOATS);
    for (int i = 0; i < ROUNDS; i++) {
        double start = fs_clock_of(CLOCK_THREAD_CPUTIME_ID);
        loops->copy(memory + COPY_FLOATS, memory, COPY_FLOATS);
        double rate = 1e-9 * 2 * sizeof(float) * COPY_FLOATS / (fs_clock_of(CLOCK_THREAD_CPUTIME_ID) - start);
        if (rate > peak->copy_gbs) peak->copy_gbs = rate;
    }
    free(memory);
    return 0;
}

// What one core of this machine can do at most: loops of nothing but multiply-adds, or loads and stores.
#pragma once

#include <stddef.h>

#include "base/cpu.h"

typedef struct PeakLoops {
    float (*fma)(long rounds); // returns something, so that it cannot be left out
    double flops_per_round;
    void (*copy)(float *to, const float *from, size_t n); // n a multiple of 64
} PeakLoops;
extern const PeakLoops fs_peak_avx2, fs_peak_avx512, fs_peak_neon;

typedef struct Peak {
    double fma_gflops; // one core, multiply and add counted as two
    double copy_gbs;   // one core, bytes read and bytes written, far beyond the caches
} Peak;
// The best of several rounds on the thread that calls; a second or so.
int fs_peak_measure(CpuLevel level, Peak *peak, FsError *err);

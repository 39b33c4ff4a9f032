// A few words for the kernel tests, which need nothing but the kernels (so that they cross-compile alone):
// every twin this machine has is run on the same random input as the scalar definition, compared, and with the
// argument --bench timed in the same body.
#ifndef TESTS_KERNELS_CHECK_H
#define TESTS_KERNELS_CHECK_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/order.h"
#include "base/rng.h"
#include "kernels/kernels.h"

static int failures, checks;
static bool bench_wanted;

#define CHECK(condition, ...)                                                                                          \
    do {                                                                                                               \
        checks++;                                                                                                      \
        if (!(condition)) {                                                                                            \
            failures++;                                                                                                \
            printf("%s:%d: %s: ", __FILE__, __LINE__, #condition);                                                     \
            printf(__VA_ARGS__);                                                                                       \
            printf("\n");                                                                                              \
        }                                                                                                              \
    } while (0)

__attribute__((unused)) static int check_begin(int argc, char **argv)
{
    bench_wanted = argc > 1 && strcmp(argv[1], "--bench") == 0;
    return 0;
}
__attribute__((unused)) static int check_end(void)
{
    printf("%d checks, %d failures\n", checks, failures);
    return failures || !checks;
}

// Fills planes with numbers in [lo, hi), the padding with large garbage.
__attribute__((unused)) static Planes random_planes(int width, int height, int channels, float lo, float hi, Rng *rng)
{
    Planes p = {width, height, channels, fs_planes_stride(width), NULL};
    size_t n = (size_t)p.stride * (size_t)height * (size_t)channels;
    p.px = aligned_alloc(64, n * sizeof(float));
    if (!p.px) abort();
    for (size_t i = 0; i < n; i++)
        p.px[i] = (int)(i % (size_t)p.stride) < width ? fs_rng_range(rng, lo, hi) : (i & 1 ? 1e30f : -1e30f);
    return p;
}
__attribute__((unused)) static Planes copy_planes(const Planes *from)
{
    Planes p = *from;
    size_t bytes = sizeof(float) * (size_t)p.stride * (size_t)p.height * (size_t)p.channels;
    p.px = aligned_alloc(64, bytes);
    if (!p.px) abort();
    memcpy(p.px, from->px, bytes);
    return p;
}

// Largest |a - b| over the image, relative to the largest |a|.
__attribute__((unused)) static double planes_difference(const Planes *a, const Planes *b)
{
    double most = 0, size = 0;
    for (int c = 0; c < a->channels; c++)
        for (int y = 0; y < a->height; y++)
            for (int x = 0; x < a->width; x++) {
                double u = fs_planes_row(a, c, y)[x], v = fs_planes_row(b, c, y)[x];
                if (!isfinite(u) || !isfinite(v)) return INFINITY;
                most = fmax(most, fabs(u - v));
                size = fmax(size, fabs(u));
            }
    return most / fmax(size, 1e-30);
}
// Largest |a - b| / (|a| + floor) of single values.
__attribute__((unused)) static double planes_relative(const Planes *a, const Planes *b, double floor)
{
    double most = 0;
    for (int c = 0; c < a->channels; c++)
        for (int y = 0; y < a->height; y++)
            for (int x = 0; x < a->width; x++) {
                double u = fs_planes_row(a, c, y)[x], v = fs_planes_row(b, c, y)[x];
                if (!isfinite(u) || !isfinite(v)) return INFINITY;
                most = fmax(most, fabs(u - v) / (fabs(u) + floor));
            }
    return most;
}

// Median CPU seconds of 7 rounds of f(context).
__attribute__((unused)) static double median_seconds(void (*f)(void *), void *context)
{
    enum { ROUNDS = 7 };
    double t[ROUNDS];
    f(context);
    for (int i = 0; i < ROUNDS; i++) {
        double begin = fs_clock_of(CLOCK_THREAD_CPUTIME_ID);
        f(context);
        t[i] = fs_clock_of(CLOCK_THREAD_CPUTIME_ID) - begin;
    }
    return fs_order_median(t, ROUNDS);
}
#define BENCH(name, level, unit, count, f, context)                                                                    \
    do {                                                                                                               \
        if (bench_wanted)                                                                                              \
            printf("%-24s %-7s %8.3f ns per %s\n", name, fs_cpu_name(level),                                           \
                   1e9 * median_seconds(f, context) / (double)(count), unit);                                          \
    } while (0)

// For each level of this machine, scalar first.
#define FOR_LEVELS(level)                                                                                              \
    for (CpuLevel level = CPU_SCALAR; level < CPU_LEVELS; level++)                                                     \
        if (fs_cpu_has(level))

// Calls f for strips of `rows` rows.
#define FOR_STRIPS(height, rows, a, b)                                                                                 \
    for (int a = 0, b = (rows) < (height) ? (rows) : (height); a < (height);                                           \
         a = b, b = b + (rows) < (height) ? b + (rows) : (height))

#endif

// Time that passes, for what people read and for planning; nothing computed may depend on it.
#ifndef FS_BASE_CLOCK_H
#define FS_BASE_CLOCK_H

#include <time.h>

static inline double fs_clock_of(clockid_t clock) // in seconds
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// Seconds from a moment that stays the same while the program runs.
static inline double fs_clock_seconds(void)
{
    return fs_clock_of(CLOCK_MONOTONIC);
}

#endif

// Preloaded into the program under test: makes its memory run out at a chosen allocation.
//   FAULT_AT=N        the Nth allocation of the process fails
//   FAULT_FROM=1      ... and all after it
//   FAULT_RECORD=FILE nothing fails; FILE gets the first N of each distinct call stack, a line each
//   FAULT_TRACE=FILE  FILE gets the call stack of the allocation that failed
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// glibc's own, under the names that are not replaced below.
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *p, size_t size);
void *__libc_memalign(size_t align, size_t size);

#define MAX_STACKS (1 << 15)
#define MAX_FRAMES 24

static atomic_long count;
static long fail_at;
static int fail_from, ready, trace_fd = -1, record_fd = -1;
static _Thread_local int inside;
static atomic_flag lock = ATOMIC_FLAG_INIT;
static struct {
    uint64_t hash;
    long first;
} stacks[MAX_STACKS];

static void remember(long n)
{
    void *frame[MAX_FRAMES];
    int frames = backtrace(frame, MAX_FRAMES);
    uint64_t hash = 14695981039346656037u;
    for (int i = 2; i < frames; i++) hash = (hash ^ (uint64_t)(uintptr_t)frame[i]) * 1099511628211u;
    while (atomic_flag_test_and_set(&lock)) {
    }
    size_t i = hash % MAX_STACKS, tries = 0;
    while (stacks[i].first && stacks[i].hash != hash && tries++ < MAX_STACKS) i = (i + 1) % MAX_STACKS;
    if (!stacks[i].first) {
        stacks[i].hash = hash;
        stacks[i].first = n;
        char line[24];
        int length = snprintf(line, sizeof line, "%ld\n", n);
        if (write(record_fd, line, (size_t)length) < 0) record_fd = -1;
    }
    atomic_flag_clear(&lock);
}

static int fails(void)
{
    if (!ready || inside) return 0;
    long n = atomic_fetch_add(&count, 1) + 1;
    int hit = fail_at && (n == fail_at || (fail_from && n > fail_at));
    if (!hit && record_fd < 0) return 0;
    int saved = errno;
    inside = 1;
    if (record_fd >= 0) remember(n);
    if (hit && trace_fd >= 0 && n == fail_at) {
        void *frame[MAX_FRAMES];
        backtrace_symbols_fd(frame, backtrace(frame, MAX_FRAMES), trace_fd);
    }
    inside = 0;
    errno = hit ? ENOMEM : saved;
    return hit;
}

static int open_named(const char *variable)
{
    const char *path = getenv(variable);
    return path ? open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666) : -1;
}

__attribute__((constructor)) static void begin(void)
{
    void *frame[2];
    backtrace(frame, 2); // loads what it needs
    const char *at = getenv("FAULT_AT");
    fail_at = at ? atol(at) : 0;
    fail_from = getenv("FAULT_FROM") != NULL;
    record_fd = open_named("FAULT_RECORD");
    trace_fd = open_named("FAULT_TRACE");
    unsetenv("LD_PRELOAD"); // for this process only
    ready = fail_at || record_fd >= 0;
}

void *malloc(size_t size)
{
    return fails() ? NULL : __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
    return fails() ? NULL : __libc_calloc(n, size);
}

void *realloc(void *p, size_t size)
{
    return fails() ? NULL : __libc_realloc(p, size);
}

void *memalign(size_t align, size_t size)
{
    return fails() ? NULL : __libc_memalign(align, size);
}

void *aligned_alloc(size_t align, size_t size)
{
    return memalign(align, size);
}

int posix_memalign(void **p, size_t align, size_t size)
{
    void *made = memalign(align, size);
    if (!made) return ENOMEM;
    *p = made;
    return 0;
}

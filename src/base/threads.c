#include "base/threads.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

typedef struct Range { // jobs that nobody has taken yet: the first in the low half, one past the last in the high one
    _Alignas(64) atomic_ullong jobs;
} Range;

struct Threads {
    int count; // with the caller
    pthread_t *thread;
    Range *range; // (count)
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    atomic_uint round; // rises with every fs_threads_for and at the end; spun on for a moment before sleeping
    atomic_int busy;
    bool quit;
    ThreadsJob *job;
    void *context;
    atomic_int started;
};

static unsigned long long range_of(int begin, int end)
{
    return (unsigned long long)end << 32 | (unsigned)begin;
}

// Takes jobs [*begin, *end) from the front, or one from the back; false where none are left. Small jobs are many, and
// taking one costs as much.
static bool take(Range *range, bool front, int *begin, int *end)
{
    unsigned long long was = range->jobs;
    for (;;) {
        int first = (int)(was & 0xffffffffu), last = (int)(was >> 32), share = 1 + (last - first) / 64;
        if (first >= last) return false;
        *begin = front ? first : last - 1;
        *end = front ? first + share : last;
        unsigned long long left = front ? range_of(*end, last) : range_of(first, *begin);
        if (atomic_compare_exchange_weak(&range->jobs, &was, left)) return true;
    }
}

// Each has its own stretch of the jobs, the same one in every round of so many: what they work on stays near its core.
// Who is done helps the others, from their far end.
static void work(Threads *t, int worker)
{
    int begin, end;
    for (int k = 0; k < t->count; k++)
        while (take(&t->range[(worker + k) % t->count], k == 0, &begin, &end))
            for (int i = begin; i < end; i++) t->job(t->context, i, worker);
}

// To sleep and to be woken takes longer than most jobs that there is nothing to do beside: first, a while of looking.
enum { SPINS = 20000 };

static void pause_a_little(void)
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
}

static void *worker_main(void *arg)
{
    Threads *t = arg;
    int index = atomic_fetch_add(&t->started, 1) + 1;
    unsigned seen = 0;
    for (;;) {
        for (int spin = 0; spin < SPINS && t->round == seen; spin++) pause_a_little();
        pthread_mutex_lock(&t->lock);
        while (t->round == seen) pthread_cond_wait(&t->start, &t->lock);
        seen = t->round;
        bool quit = t->quit;
        pthread_mutex_unlock(&t->lock);
        if (quit) return NULL;
        work(t, index);
        pthread_mutex_lock(&t->lock);
        if (--t->busy == 0) pthread_cond_signal(&t->done);
        pthread_mutex_unlock(&t->lock);
    }
}

Threads *fs_threads_new(int n)
{
    if (n <= 0) n = (int)sysconf(_SC_NPROCESSORS_ONLN);
    if (n < 1) n = 1;
    Threads *t = calloc(1, sizeof *t);
    if (!t) return NULL;
    t->thread = calloc((size_t)n, sizeof *t->thread);
    t->range = aligned_alloc(_Alignof(Range), (size_t)n * sizeof *t->range);
    if (!t->thread || !t->range) {
        free(t->thread);
        free(t->range);
        free(t);
        return NULL;
    }
    pthread_mutex_init(&t->lock, NULL);
    pthread_cond_init(&t->start, NULL);
    pthread_cond_init(&t->done, NULL);
    t->count = 1;
    while (t->count < n && pthread_create(&t->thread[t->count], NULL, worker_main, t) == 0) t->count++;
    return t;
}

void fs_threads_free(Threads *t)
{
    if (!t) return;
    pthread_mutex_lock(&t->lock);
    t->quit = true;
    t->round++;
    pthread_cond_broadcast(&t->start);
    pthread_mutex_unlock(&t->lock);
    for (int i = 1; i < t->count; i++) pthread_join(t->thread[i], NULL);
    pthread_mutex_destroy(&t->lock);
    pthread_cond_destroy(&t->start);
    pthread_cond_destroy(&t->done);
    free(t->thread);
    free(t->range);
    free(t);
}

int fs_threads_count(const Threads *t)
{
    return t ? t->count : 1;
}

void fs_threads_for(Threads *t, int n, ThreadsJob *job, void *context)
{
    if (!t || t->count == 1 || n <= 1) {
        for (int i = 0; i < n; i++) job(context, i, 0);
        return;
    }
    pthread_mutex_lock(&t->lock);
    t->job = job;
    t->context = context;
    for (int k = 0; k < t->count; k++)
        t->range[k].jobs = range_of((int)((long long)n * k / t->count), (int)((long long)n * (k + 1) / t->count));
    t->busy = t->count - 1;
    t->round++;
    pthread_cond_broadcast(&t->start);
    pthread_mutex_unlock(&t->lock);
    work(t, 0);
    for (int spin = 0; spin < SPINS && t->busy; spin++) pause_a_little();
    pthread_mutex_lock(&t->lock);
    while (t->busy) pthread_cond_wait(&t->done, &t->lock);
    pthread_mutex_unlock(&t->lock);
}

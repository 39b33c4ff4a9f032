#include "base/threads.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

struct Threads {
    int count; // with the caller
    pthread_t *thread;
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    atomic_uint round; // rises with every fs_threads_for and at the end; spun on for a moment before sleeping
    int busy;
    bool quit;
    ThreadsJob *job;
    void *context;
    int n;
    atomic_int next, started;
};

static void work(Threads *t, int worker)
{
    int share = 1 + t->n / (64 * t->count); // taken at once: small jobs are many, and taking one costs as much
    for (int i; (i = atomic_fetch_add(&t->next, share)) < t->n;)
        for (int k = 0; k < share && i + k < t->n; k++) t->job(t->context, i + k, worker);
}

static void *worker_main(void *arg)
{
    Threads *t = arg;
    int index = atomic_fetch_add(&t->started, 1) + 1;
    unsigned seen = 0;
    for (;;) {
        for (int spin = 0; spin < 4000 && t->round == seen; spin++) {
#if defined(__x86_64__)
            __builtin_ia32_pause();
#endif
        }
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
    if (!t->thread) {
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
    t->n = n;
    atomic_store(&t->next, 0);
    t->busy = t->count - 1;
    t->round++;
    pthread_cond_broadcast(&t->start);
    pthread_mutex_unlock(&t->lock);
    work(t, 0);
    pthread_mutex_lock(&t->lock);
    while (t->busy) pthread_cond_wait(&t->done, &t->lock);
    pthread_mutex_unlock(&t->lock);
}

// A pool of threads that runs numbered jobs. Results must depend on the job number only, never on the worker,
// so that any number of threads gives the same bits.
#pragma once

typedef struct Threads Threads;
typedef void ThreadsJob(void *context, int job, int worker); // worker: 0 .. count-1, for scratch memory

Threads *fs_threads_new(int n); // n <= 0: one per core; NULL when out of memory
void fs_threads_free(Threads *threads);
int fs_threads_count(const Threads *threads);
// Runs job 0..n-1 on all threads (the caller's too), each beginning with its own stretch of them, in rising order; returns
// when all are done.
// threads may be NULL: the caller runs them alone.
void fs_threads_for(Threads *threads, int n, ThreadsJob *job, void *context);

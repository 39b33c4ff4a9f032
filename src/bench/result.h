// What the bench found, as a table, as JSON, and two such files compared.
#pragma once

#include "base/error.h"
#include "base/log.h"

typedef struct BenchWork {       // of one call
    double pairs;                // units
    double flops, bytes, splats; // 0: not counted
} BenchWork;

typedef struct BenchResult {
    char name[64];
    char unit[16];     // what `pairs` counts
    double ms, cpu_ms; // medians: elapsed, and CPU time of all threads
    BenchWork work;
    double share_of_fma_peak; // flops per CPU second / one core's peak; 0 where not counted
} BenchResult;

typedef struct BenchResults {
    BenchResult *row;
    int n;
    char cpu[16];
    int threads;
} BenchResults;

int fs_result_add(BenchResults *results, const BenchResult *row, FsError *err);
void fs_result_free(BenchResults *results);
void fs_result_log(const BenchResult *row, const Log *log);                       // NULL: the heading
int fs_result_write(const BenchResults *results, const char *path, FsError *err); // a JSON list of cases
// "FILE,FILE": the times of the cases in both, and first / second.
int fs_result_compare(const char *files, const Log *log, FsError *err);

#include "bench/bench.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/json_file.h"
#include "base/order.h"
#include "bench/case.h"
#include "bench/peak.h"
#include "bench/result.h"

#define IMAGE(kernel, call_, unit_, size, width_, height_)                                                             \
    {                                                                                                                  \
        .name = kernel "/" size, .unit = #unit_, .open = fs_case_image_open, .call = fs_case_image_##call_,            \
        .close = fs_case_image_close, .width = width_, .height = height_                                               \
    }
#define IMAGES(size, width, height)                                                                                    \
    IMAGE("compose_forward", compose_forward, value, size, width, height),                                             \
        IMAGE("compose_backward", compose_backward, value, size, width, height),                                       \
        IMAGE("photometric", photometric, value, size, width, height),                                                 \
        IMAGE("pearson", pearson, value, size, width, height), IMAGE("smooth", smooth, pixel, size, width, height)
#define SPLATS(name_, call_, n_, width_, height_, pairs_)                                                              \
    {                                                                                                                  \
        .name = name_, .unit = "pair", .open = fs_case_splats_open, .call = fs_case_splats_##call_,                    \
        .close = fs_case_splats_close, .n = n_, .width = width_, .height = height_, .wanted = pairs_                   \
    }
#define RASTER(count, n, size, width, height)                                                                          \
    SPLATS("forward/" count "/" size, forward, n, width, height, 50.0 * width * height),                               \
        SPLATS("backward/" count "/" size, backward, n, width, height, 50.0 * width * height),                         \
        SPLATS("raster/" count "/" size, raster, n, width, height, 50.0 * width * height)
#define RASTERS(size, width, height)                                                                                   \
    RASTER("10k", 10000, size, width, height), RASTER("50k", 50000, size, width, height),                              \
        RASTER("200k", 200000, size, width, height), RASTER("500k", 500000, size, width, height)

static const BenchCase cases[] = {
    IMAGES("300x200", 300, 200),
    IMAGES("1200x800", 1200, 800),
    {"adam/all/100k", "parameter", fs_case_adam_open, fs_case_adam_call, fs_case_adam_close, 100000, .wanted = 1},
    {"adam/quarter/100k", "parameter", fs_case_adam_open, fs_case_adam_call, fs_case_adam_close, 100000,
     .wanted = 0.25},
    RASTERS("300x200", 300, 200),
    RASTERS("600x400", 600, 400),
    RASTERS("1200x800", 1200, 800),
    // One 3-channel model, forward + loss + backward + Adam, at the size and with the contributing pairs at which
    // OpenSplat was measured.
    SPLATS("step/20k", step, 20000, 571, 421, 12e6),
    SPLATS("step/50k", step, 50000, 571, 421, 19e6),
    SPLATS("step/100k", step, 100000, 571, 421, 25e6),
    // What training does, twice: 2 x 20k and 2 x 40k Gaussians are the preset `preview` early and late.
    {"train/20k/300x200", "splat", fs_case_train_open, fs_case_train_call, fs_case_train_close, 20000, 300, 200},
    {"train/40k/300x200", "splat", fs_case_train_open, fs_case_train_call, fs_case_train_close, 40000, 300, 200},
    {"train/40k/600x400", "splat", fs_case_train_open, fs_case_train_call, fs_case_train_close, 40000, 600, 400},
};

enum { ROUNDS_MIN = 5, ROUNDS_MAX = 200 };

// Medians over the calls that fit into about half a second, at least ROUNDS_MIN.
static void time_case(const BenchCase *what, void *state, BenchResult *r)
{
    double wall[ROUNDS_MAX], cpu[ROUNDS_MAX], start = fs_clock_seconds();
    int n = 0;
    r->work = what->call(state);
    while (n < ROUNDS_MIN || (n < ROUNDS_MAX && fs_clock_seconds() - start < 0.5)) {
        double w = fs_clock_seconds(), c = fs_clock_of(CLOCK_PROCESS_CPUTIME_ID);
        what->call(state);
        wall[n] = fs_clock_seconds() - w;
        cpu[n++] = fs_clock_of(CLOCK_PROCESS_CPUTIME_ID) - c;
    }
    r->ms = 1e3 * fs_order_median(wall, (size_t)n);
    r->cpu_ms = 1e3 * fs_order_median(cpu, (size_t)n);
}

static int run_case(const BenchCase *what, const BenchMachine *machine, const Peak *peak, BenchResult *r, FsError *err)
{
    void *state = what->open(machine, what);
    if (!state) return fs_error_memory(err);
    *r = (BenchResult){0};
    snprintf(r->name, sizeof r->name, "%s", what->name);
    snprintf(r->unit, sizeof r->unit, "%s", what->unit);
    time_case(what, state, r);
    if (r->cpu_ms > 0) r->share_of_fma_peak = 1e-6 * r->work.flops / r->cpu_ms / peak->fma_gflops;
    what->close(state);
    return 0;
}

// The two loops of peak.h as cases: what the others are measured against.
static int add_peaks(BenchResults *results, const Peak *peak, const Log *log, FsError *err)
{
    BenchResult fma = {.name = "peak/fma", .unit = "flop", .ms = 1, .cpu_ms = 1, .share_of_fma_peak = 1};
    BenchResult copy = {.name = "peak/copy", .unit = "byte", .ms = 1, .cpu_ms = 1};
    fma.work.pairs = fma.work.flops = 1e6 * peak->fma_gflops; // in a millisecond
    copy.work.pairs = copy.work.bytes = 1e6 * peak->copy_gbs;
    fs_result_log(&fma, log);
    fs_result_log(&copy, log);
    MUST(fs_result_add(results, &fma, err));
    return fs_result_add(results, &copy, err);
}

static int run_all(const FsSettings *set, const BenchMachine *machine, BenchResults *results, const Log *log,
                   FsError *err)
{
    int n = (int)(sizeof cases / sizeof *cases), ran = 0;
    Peak peak;
    MUST(fs_peak_measure(machine->kernels.level, &peak, err));
    fs_result_log(NULL, log);
    MUST(add_peaks(results, &peak, log, err));
    for (int i = 0; i < n; i++) {
        if (set->cases && !strstr(cases[i].name, set->cases)) continue;
        if (fs_log_cancelled(log)) return fs_error_set(err, FS_ERR_CANCELLED, "bench: cancelled");
        fs_log_progress(log, "bench", i, n, cases[i].name);
        BenchResult row;
        MUST(run_case(&cases[i], machine, &peak, &row, err));
        fs_result_log(&row, log);
        MUST(fs_result_add(results, &row, err));
        ran++;
    }
    return ran ? 0 : fs_error_set(err, FS_ERR_USAGE, "--cases %s: no case's name contains that", set->cases);
}

int fs_bench_run(const FsSettings *settings, const Log *log, FsError *err)
{
    int rc = 0;
    BenchMachine machine = {0};
    BenchResults results = {0};
    if (settings->compare && *settings->compare) return fs_result_compare(settings->compare, log, err);
    if (settings->json && *settings->json) TRY(fs_json_file_check(settings->json, "ms", err));
    TRY(fs_kernels_choose(settings->cpu, &machine.kernels, err));
    machine.threads = fs_threads_new(settings->threads);
    if (!machine.threads) TRY(fs_error_memory(err));
    snprintf(results.cpu, sizeof results.cpu, "%s", fs_cpu_name(machine.kernels.level));
    results.threads = fs_threads_count(machine.threads);
    fs_log_info(log, "instruction set %s, %d threads (image and Adam kernels: one)", results.cpu, results.threads);
    TRY(run_all(settings, &machine, &results, log, err));
    if (settings->json && *settings->json) TRY(fs_result_write(&results, settings->json, err));
fail:
    fs_result_free(&results);
    fs_threads_free(machine.threads);
    return rc;
}

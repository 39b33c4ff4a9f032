#include "bench/result.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_file.h"

#define MAX_FILE (16 << 20)

int fs_result_add(BenchResults *results, const BenchResult *row, FsError *err)
{
    BenchResult *rows = realloc(results->row, sizeof *rows * (size_t)(results->n + 1));
    if (!rows) return fs_error_memory(err);
    results->row = rows;
    rows[results->n++] = *row;
    return 0;
}

void fs_result_free(BenchResults *results)
{
    free(results->row);
    *results = (BenchResults){0};
}

static double ns_per_pair(const BenchResult *r)
{
    return r->work.pairs > 0 ? 1e6 * r->cpu_ms / r->work.pairs : 0;
}
static double rate(double amount, const BenchResult *r) // 1e9 per CPU second
{
    return r->cpu_ms > 0 ? 1e-6 * amount / r->cpu_ms : 0;
}

void fs_result_log(const BenchResult *r, const Log *log)
{
    if (!r) {
        fs_log_info(log, "%-26s %9s %9s %10s %17s %8s %7s %8s %7s", "case", "ms", "cpu ms", "units", "cpu ns / unit",
                    "GFLOP/s", "GB/s", "Msplat/s", "of peak");
        return;
    }
    char flops[16] = "", bytes[16] = "", splats[16] = "", share[16] = "", per[32] = "";
    if (r->work.flops > 0) snprintf(flops, sizeof flops, "%.1f", rate(r->work.flops, r));
    if (r->work.bytes > 0) snprintf(bytes, sizeof bytes, "%.1f", rate(r->work.bytes, r));
    if (r->work.splats > 0) snprintf(splats, sizeof splats, "%.2f", 1e3 * rate(r->work.splats, r));
    if (r->share_of_fma_peak > 0) snprintf(share, sizeof share, "%.1f %%", 100 * r->share_of_fma_peak);
    if (r->work.pairs > 0) snprintf(per, sizeof per, "%.3f %s", ns_per_pair(r), r->unit);
    fs_log_info(log, "%-26s %9.3f %9.3f %10.0f %17s %8s %7s %8s %7s", r->name, r->ms, r->cpu_ms, r->work.pairs, per,
                flops, bytes, splats, share);
}

int fs_result_write(const BenchResults *results, const char *path, FsError *err)
{
    json_t *list = json_array();
    for (int i = 0; i < results->n; i++) {
        const BenchResult *r = &results->row[i];
        json_array_append_new(list, json_pack("{s:s, s:f, s:f, s:f, s:s, s:f, s:f, s:f, s:f, s:f, s:s, s:i}", "name",
                                              r->name, "ms", r->ms, "cpu_ms", r->cpu_ms, "pairs", r->work.pairs, "unit",
                                              r->unit, "ns_per_pair", ns_per_pair(r), "gflops", rate(r->work.flops, r),
                                              "gbs", rate(r->work.bytes, r), "splats_per_s",
                                              1e9 * rate(r->work.splats, r), "share_of_fma_peak", r->share_of_fma_peak,
                                              "cpu", results->cpu, "threads", results->threads));
    }
    return fs_json_file_write(path, list, JSON_INDENT(1) | JSON_REAL_PRECISION(6), err);
}

static int read_row(BenchResult *row, const json_t *item, const char *path, int i, FsError *err)
{
    const char *name = json_string_value(json_object_get(item, "name"));
    *row = (BenchResult){.ms = json_number_value(json_object_get(item, "ms")),
                         .cpu_ms = json_number_value(json_object_get(item, "cpu_ms"))};
    if (!name || !*name || strlen(name) >= sizeof row->name || !(row->ms > 0))
        return fs_error_input(err, "%s: case %d has no name and positive ms; make it with bench --json", path, i + 1);
    strcpy(row->name, name);
    return 0;
}

static int read_results(BenchResults *results, const char *path, FsError *err)
{
    int rc;
    json_t *list;
    *results = (BenchResults){0};
    TRY(fs_json_file_read(path, MAX_FILE, &list, err));
    if (!json_is_array(list)) TRY(fs_error_input(err, "%s: not a JSON list of cases; make it with bench --json", path));
    for (size_t i = 0; i < json_array_size(list); i++) {
        BenchResult row;
        TRY(read_row(&row, json_array_get(list, i), path, (int)i, err));
        TRY(fs_result_add(results, &row, err));
    }
fail:
    json_decref(list);
    if (rc < 0) fs_result_free(results);
    return rc;
}

static const BenchResult *find(const BenchResults *results, const char *name)
{
    for (int i = 0; i < results->n; i++)
        if (strcmp(results->row[i].name, name) == 0) return &results->row[i];
    return NULL;
}

static void log_ratios(const BenchResults *a, const BenchResults *b, const Log *log)
{
    double sum = 0;
    int n = 0;
    fs_log_info(log, "%-26s %10s %10s %8s %10s %10s %8s", "case", "first ms", "second ms", "ratio", "cpu ms", "cpu ms",
                "ratio");
    for (int i = 0; i < a->n; i++) {
        const BenchResult *p = &a->row[i], *q = find(b, p->name);
        if (!q) {
            fs_log_info(log, "%-26s %10.3f %10s", p->name, p->ms, "-");
            continue;
        }
        double cpu = q->cpu_ms > 0 ? p->cpu_ms / q->cpu_ms : 0;
        fs_log_info(log, "%-26s %10.3f %10.3f %7.2fx %10.3f %10.3f %7.2fx", p->name, p->ms, q->ms, p->ms / q->ms,
                    p->cpu_ms, q->cpu_ms, cpu);
        sum += log1p(p->ms / q->ms - 1);
        n++;
    }
    for (int i = 0; i < b->n; i++)
        if (!find(a, b->row[i].name)) fs_log_info(log, "%-26s %10s %10.3f", b->row[i].name, "-", b->row[i].ms);
    if (n) fs_log_info(log, "%d cases in both; first / second, geometric mean: %.3fx", n, exp(sum / n));
}

int fs_result_compare(const char *files, const Log *log, FsError *err)
{
    BenchResults a = {0}, b = {0};
    char *first = strdup(files), *second = first ? strchr(first, ',') : NULL;
    int rc;
    if (!first) return fs_error_memory(err);
    if (!second || !second[1] || second == first)
        TRY(fs_error_set(err, FS_ERR_USAGE, "--compare %s: needs two files of bench --json, as FILE,FILE", files));
    *second++ = 0;
    TRY(read_results(&a, first, err));
    TRY(read_results(&b, second, err));
    log_ratios(&a, &b, log);
    rc = 0;
fail:
    fs_result_free(&a);
    fs_result_free(&b);
    free(first);
    return rc;
}

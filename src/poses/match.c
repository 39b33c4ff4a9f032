#include "poses/match.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/order.h"

// The compiler vectorises the products; on x86 it makes a second version for AVX2. Integers: the same on every machine.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) &&               \
    !defined(__SANITIZE_THREAD__)
#define WIDER __attribute__((target_clones("default", "avx2")))
#else
#define WIDER
#endif

enum { TILE = 8, MAX_DISTANCE_DOT = 198000 };                  // distance 0.7: as COLMAP's default
enum { GLANCE_FEATURES = 200, PARTNERS = 30, NEIGHBOURS = 3 }; // of fs_match_choose

int fs_match_dot(const int16_t *a, const int16_t *b)
{
    int sum = 0;
    for (int k = 0; k < FS_DESCRIPTOR; k++) sum += (int)a[k] * b[k];
    return sum;
}

float fs_match_distance(int dot)
{
    float cosine = (float)dot / (512.0f * 512.0f);
    return cosine < 1 ? sqrtf(2 - 2 * cosine) : 0;
}

int fs_match_pair(int i, int j)
{
    return j * (j - 1) / 2 + i;
}

size_t fs_match_pairs(int n)
{
    return (size_t)n * (size_t)(n - 1) / 2;
}

void fs_match_free(MatchList *list, int n)
{
    for (size_t i = 0; i < fs_match_pairs(n) && list; i++) free(list[i].match);
    free(list);
}

// Scalar products of `rows` descriptors of a with all of b into dot (rows, nb).
WIDER static void products(const int16_t *a, int rows, const int16_t *b, int nb, int *dot)
{
    for (int j = 0; j < nb; j++) {
        const int16_t *q = b + (size_t)j * FS_DESCRIPTOR;
        for (int i = 0; i < rows; i++) {
            const int16_t *p = a + (size_t)i * FS_DESCRIPTOR;
            int sum = 0;
            for (int k = 0; k < FS_DESCRIPTOR; k++) sum += (int)p[k] * q[k];
            dot[(size_t)i * (size_t)nb + (size_t)j] = sum;
        }
    }
}

typedef struct Subset { // the features of one picture that take part, packed
    int n;
    int *index;
    int16_t *descriptor;
} Subset;

typedef struct Work {
    const Subset *subset;
    const MatchOptions *options;
    MatchList *list;
    int first; // column of job 0
    bool failed;
} Work;

static int match_two(const Subset *a, const Subset *b, float max_ratio, MatchList *list)
{
    int rc = -1;
    Arena arena = {0};
    int *dot = ARENA_NEW(&arena, int, ((size_t)b->n + 1) * TILE);
    MatchBest *row = ARENA_NEW(&arena, MatchBest, (size_t)a->n + 1),
              *col = ARENA_NEW(&arena, MatchBest, (size_t)b->n + 1);
    list->n = 0;
    list->match = malloc(((size_t)a->n + 1) * sizeof *list->match);
    if (arena.failed || !list->match) goto fail;
    for (int i = 0; i < a->n; i++) row[i] = (MatchBest){-1, 0, 0};
    for (int j = 0; j < b->n; j++) col[j] = (MatchBest){-1, 0, 0};
    for (int i0 = 0; i0 < a->n; i0 += TILE) {
        int rows = a->n - i0 < TILE ? a->n - i0 : TILE;
        products(a->descriptor + (size_t)i0 * FS_DESCRIPTOR, rows, b->descriptor, b->n, dot);
        for (int i = 0; i < rows; i++)
            for (int j = 0; j < b->n; j++) {
                int v = dot[(size_t)i * (size_t)b->n + (size_t)j];
                fs_match_keep(&row[i0 + i], j, v);
                fs_match_keep(&col[j], i0 + i, v);
            }
    }
    for (int i = 0; i < a->n; i++) {
        int j = row[i].at;
        if (j < 0 || col[j].at != i || row[i].first < MAX_DISTANCE_DOT) continue;
        float d = fs_match_distance(row[i].first);
        if (d > max_ratio * fs_match_distance(row[i].second) || d > max_ratio * fs_match_distance(col[j].second))
            continue;
        list->match[list->n++] = (Match){a->index[i], b->index[j]};
    }
    Match *fitting = realloc(list->match, ((size_t)list->n + 1) * sizeof *fitting); // pairs are many
    if (fitting) list->match = fitting;
    rc = 0;
fail:
    fs_arena_free(&arena);
    return rc;
}

static void match_job(void *context, int job, int worker)
{
    (void)worker;
    Work *work = context;
    int j = work->first + job;
    for (int i = 0; i < j; i++) {
        int pair = fs_match_pair(i, j);
        if (work->options->pair && !work->options->pair[pair]) continue;
        if (match_two(&work->subset[i], &work->subset[j], work->options->max_ratio, &work->list[pair]) < 0)
            __atomic_store_n(&work->failed, true, __ATOMIC_RELAXED);
    }
}

static int choose(const Features *f, int max_features, Subset *s, Arena *arena, FsError *err)
{
    Ranked *order = ARENA_NEW(arena, Ranked, (size_t)f->n + 1); // the largest first
    s->n = f->n < max_features ? f->n : max_features;
    s->index = ARENA_NEW(arena, int, (size_t)s->n + 1);
    s->descriptor = ARENA_NEW(arena, int16_t, ((size_t)s->n + 1) * FS_DESCRIPTOR);
    if (arena->failed) return fs_error_memory(err);
    for (int i = 0; i < f->n; i++) order[i] = (Ranked){-f->scale[i], i};
    fs_order_ranked(order, (size_t)f->n);
    for (int i = 0; i < s->n; i++) {
        s->index[i] = order[i].index;
        memcpy(s->descriptor + (size_t)i * FS_DESCRIPTOR, f->descriptor + (size_t)order[i].index * FS_DESCRIPTOR,
               FS_DESCRIPTOR * sizeof *s->descriptor);
    }
    return 0;
}

int fs_match_all(const Features *features, int n, MatchOptions options, Threads *threads, const Log *log,
                 MatchList *list, FsError *err)
{
    int rc = 0, step = 4 * fs_threads_count(threads);
    Arena arena = {0};
    Subset *subset = ARENA_NEW(&arena, Subset, (size_t)n + 1);
    Work work = {.subset = subset, .options = &options, .list = list};
    memset(list, 0, fs_match_pairs(n) * sizeof *list);
    if (!subset) TRY(fs_error_memory(err));
    for (int i = 0; i < n; i++) TRY(choose(&features[i], options.max_features, &subset[i], &arena, err));
    for (; work.first < n; work.first += step) { // some columns of the triangle at a time, to be cancelled between
        fs_log_progress(log, "poses", work.first, n, "matching");
        if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "poses: cancelled while matching"));
        fs_threads_for(threads, step < n - work.first ? step : n - work.first, match_job, &work);
        if (work.failed) TRY(fs_error_memory(err));
    }
fail:
    fs_arena_free(&arena);
    return rc;
}

int fs_match_choose(const Features *features, int n, Threads *threads, const Log *log, bool *pair, FsError *err)
{
    int rc = 0;
    MatchList *list = calloc(fs_match_pairs(n) + 1, sizeof *list);
    Ranked *other = malloc(((size_t)n + 1) * sizeof *other);
    if (!list || !other) TRY(fs_error_memory(err));
    memset(pair, 0, fs_match_pairs(n) * sizeof *pair);
    TRY(fs_match_all(features, n, (MatchOptions){GLANCE_FEATURES, 0.8f, NULL}, threads, log, list, err));
    for (int i = 0; i < n; i++) {
        int k = 0;
        for (int j = 0; j < n; j++)
            if (j != i) { // where little is in common, the nearest by name
                int at = i < j ? fs_match_pair(i, j) : fs_match_pair(j, i), apart = abs(i - j);
                other[k++] = (Ranked){apart <= NEIGHBOURS ? -INFINITY : (double)apart / n - list[at].n, at};
            }
        fs_order_ranked(other, (size_t)k);
        for (k = 0; k < n - 1 && k < PARTNERS; k++) pair[other[k].index] = true;
    }
fail:
    fs_match_free(list, n);
    free(other);
    return rc;
}

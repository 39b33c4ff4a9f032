// Along each of eight directions r (Hirschmueller 2005), with cost C = -score:
//   L(p, d) = C(p, d) + min(L(p-r, d), L(p-r, d +- 1) + small, min_k L(p-r, k) + large) - min_k L(p-r, k)
// and the step with the least sum of L over the directions wins.
#include "initialise/semiglobal.h"

#include <math.h>
#include <string.h>

#include "base/arena.h"

typedef struct Paths {
    const float *score;
    int width, height, steps;
    float small, large;
    float *sum;          // (height, width, steps)
    float *row[2];       // (width, steps + 2): L of the row before and of this one, INFINITY at both ends of a pixel
    float *row_least[2]; // (width)
} Paths;

static float lesser(float a, float b) // not fminf: this compiles to one instruction
{
    return a < b ? a : b;
}

static float least_of(const float *value, int n)
{
    float least[8], all;
    int d = 0;
    for (int k = 0; k < 8; k++) least[k] = value[0];
    for (; d + 8 <= n; d += 8)
        for (int k = 0; k < 8; k++) least[k] = lesser(least[k], value[d + k]);
    all = least[0];
    for (int k = 1; k < 8; k++) all = lesser(all, least[k]);
    for (; d < n; d++) all = lesser(all, value[d]);
    return all;
}

// L of one pixel from that of the pixel before it (NULL: none). Returns its least.
static float follow(const Paths *p, const float *restrict score, const float *restrict before, float least,
                    float *restrict now, float *restrict sum)
{
    float far = least + p->large, small = p->small;
    if (!before) {
        for (int d = 0; d < p->steps; d++) now[d + 1] = -score[d];
    } else {
        for (int d = 0; d < p->steps; d++) {
            float beside = lesser(before[d], before[d + 2]) + small;
            now[d + 1] = lesser(lesser(before[d + 1], beside), far) - least - score[d];
        }
    }
    for (int d = 0; d < p->steps; d++) sum[d] += now[d + 1];
    now[0] = now[p->steps + 1] = INFINITY;
    return least_of(now + 1, p->steps);
}

// One direction with step (dx, dy), dy 0 or along the rows.
static void aggregate(Paths *p, int dx, int dy)
{
    size_t pitch = (size_t)p->steps + 2;
    for (int j = 0; j < p->height; j++) {
        int y = dy < 0 ? p->height - 1 - j : j;
        float *before = p->row[j % 2], *now = p->row[1 - j % 2];
        float *before_least = p->row_least[j % 2], *now_least = p->row_least[1 - j % 2];
        for (int i = 0; i < p->width; i++) {
            int x = dy == 0 && dx < 0 ? p->width - 1 - i : i, from = x - dx;
            size_t at = ((size_t)y * (size_t)p->width + (size_t)x) * (size_t)p->steps;
            bool first = dy == 0 ? i == 0 : j == 0 || from < 0 || from >= p->width;
            const float *source = dy == 0 ? now : before, *least = dy == 0 ? now_least : before_least;
            now_least[x] = follow(p, p->score + at, first ? NULL : source + pitch * (size_t)from,
                                  first ? 0 : least[from], now + pitch * (size_t)x, p->sum + at);
        }
    }
}

static float pick(const float *sum, int steps)
{
    int best = 0;
    for (int d = 1; d < steps; d++)
        if (sum[d] < sum[best]) best = d;
    if (best == 0 || best == steps - 1) return (float)best;
    float a = sum[best - 1], b = sum[best], c = sum[best + 1], bend = a - 2 * b + c;
    return (float)best + (bend > 0 ? 0.5f * (a - c) / bend : 0);
}

int fs_semiglobal_choose(const ScoreVolume *volume, float small, float large, float *best, FsError *err)
{
    int width = volume->width, height = volume->height, steps = volume->steps;
    static const int direction[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}};
    size_t n = (size_t)width * (size_t)height, row = (size_t)width * ((size_t)steps + 2);
    Arena arena = {0};
    Paths p = {volume->score,
               width,
               height,
               steps,
               small,
               large,
               ARENA_NEW(&arena, float, n *(size_t)steps),
               {ARENA_NEW(&arena, float, row), ARENA_NEW(&arena, float, row)},
               {ARENA_NEW(&arena, float, width), ARENA_NEW(&arena, float, width)}};
    int rc = 0;
    if (arena.failed) TRY(fs_error_memory(err));
    memset(p.sum, 0, sizeof(float) * n * (size_t)steps);
    for (int r = 0; r < 8; r++) aggregate(&p, direction[r][0], direction[r][1]);
    for (size_t i = 0; i < n; i++) best[i] = pick(p.sum + i * (size_t)steps, steps);
fail:
    fs_arena_free(&arena);
    return rc;
}

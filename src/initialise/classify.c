// Mean field on a graph of neighbours. Each point has odds p of being transmitted; they are renewed a fixed number of
// times from
//   rare    how much rarer mirrored points are, whatever else is known
//   own     the likelihood of its contrast growth: around 1 when mirrored, around that of the transmitted points about
//           it otherwise (the flash weakens smoothly along a surface, and far surfaces get hardly any of it)
//   depth   how often clear points of either kind occur at this depth
//   + near  the odds of its neighbours in space
//   - ray   the odds of points in the same direction but at other depths
#include "initialise/classify.h"

#include <math.h>
#include <string.h>

#include "base/arena.h"
#include "base/knn.h"
#include "base/order.h"
#include "initialise/constants.h"

typedef struct Graph {
    int n;
    float *place; // (n, 3): direction, CLASSIFY_DEPTH_SCALE * log depth
    float *log_depth;
    float *slope, *sigma;    // log of the contrast's growth
    int *near, *field, *ray; // neighbours (n, N_*)
    float *near_weight, *field_weight, *ray_weight;
    float *p, *p_next, *depth_odds, *evidence;
    float table_lit[DEPTH_ODDS_STEPS], table_mirrored[DEPTH_ODDS_STEPS];
    DepthOdds depths; // its places are those of the tables, too
} Graph;

// Lives as long as the arena.
static int graph_new(Graph *g, int n, Arena *arena, FsError *err)
{
    size_t m = (size_t)n;
    *g = (Graph){.n = n};
    g->place = ARENA_NEW(arena, float, 3 * m);
    g->near = ARENA_NEW(arena, int, GRAPH_NEAR *m);
    g->field = ARENA_NEW(arena, int, GRAPH_FIELD *m);
    g->ray = ARENA_NEW(arena, int, GRAPH_RAY *m);
    g->near_weight = ARENA_NEW(arena, float, GRAPH_NEAR *m);
    g->field_weight = ARENA_NEW(arena, float, GRAPH_FIELD *m);
    g->ray_weight = ARENA_NEW(arena, float, GRAPH_RAY *m);
    float **const one[] = {&g->log_depth, &g->slope, &g->sigma, &g->p, &g->p_next, &g->depth_odds, &g->evidence};
    for (size_t i = 0; i < sizeof one / sizeof *one; i++) *one[i] = ARENA_NEW(arena, float, m);
    return arena->failed ? fs_error_memory(err) : 0;
}

// Distances become weights; missing neighbours get weight 0.
static void weigh(int n, int k, int *index, float *weight, float radius)
{
    for (size_t i = 0; i < (size_t)n * (size_t)k; i++) {
        weight[i] = index[i] < 0 ? 0 : expf(-weight[i] / (2 * radius * radius));
        if (index[i] < 0) index[i] = 0;
    }
}

static int link_neighbours(Graph *g, Arena *arena, Threads *threads, FsError *err)
{
    float *direction = ARENA_NEW(arena, float, 3 * (size_t)g->n);
    if (!direction) return fs_error_memory(err);
    for (int i = 0; i < 3 * g->n; i++) direction[i] = i % 3 == 2 ? 0 : g->place[i];
    if (fs_knn(g->place, g->n, GRAPH_NEAR, g->near, g->near_weight, threads) < 0 ||
        fs_knn(g->place, g->n, GRAPH_FIELD, g->field, g->field_weight, threads) < 0 ||
        fs_knn(direction, g->n, GRAPH_RAY, g->ray, g->ray_weight, threads) < 0)
        return fs_error_memory(err);
    weigh(g->n, GRAPH_NEAR, g->near, g->near_weight, CLASSIFY_NEAR_RADIUS);
    weigh(g->n, GRAPH_FIELD, g->field, g->field_weight, CLASSIFY_FIELD_RADIUS);
    weigh(g->n, GRAPH_RAY, g->ray, g->ray_weight, CLASSIFY_RAY_RADIUS);
    for (int i = 0; i < g->n; i++)
        for (int k = 0; k < GRAPH_RAY; k++) {
            size_t at = (size_t)i * GRAPH_RAY + (size_t)k;
            float apart = (fabsf(g->log_depth[g->ray[at]] - g->log_depth[i]) - CLASSIFY_RAY_APART) / CLASSIFY_RAY_RAMP;
            g->ray_weight[at] *= fminf(fmaxf(apart, 0), 1);
        }
    return 0;
}

static float bell(float x, float mean, float variance)
{
    return expf(-0.5f * (x - mean) * (x - mean) / variance) / sqrtf(variance);
}

static float own_odds(float slope, float sigma, float lit, float lit_spread)
{
    float s2 = sigma * sigma; // brighter than expected is as good as expected
    float transmitted = bell(fminf(slope, lit), lit, s2 + lit_spread * lit_spread);
    float mirrored = bell(slope, MIRRORED_SLOPE, s2 + MIRRORED_SPREAD * MIRRORED_SPREAD);
    return logf((transmitted + CLASSIFY_OUTLIERS) / (mirrored + CLASSIFY_OUTLIERS));
}

static float to_probability(float odds)
{
    return 1 / (1 + expf(-fminf(fmaxf(odds, -20), 20)));
}

static void depth_table(const Graph *g, const float *weight, float *table)
{
    double total = 0;
    for (int d = 0; d < DEPTH_ODDS_STEPS; d++) table[d] = 0;
    for (int i = 0; i < g->n; i++) {
        if (weight[i] <= 0) continue;
        total += (double)weight[i];
        for (int d = 0; d < DEPTH_ODDS_STEPS; d++) {
            float x = (g->log_depth[i] - g->depths.min - (float)d * g->depths.step) / CLASSIFY_DEPTH_KERNEL;
            table[d] += weight[i] * expf(-0.5f * x * x) / (CLASSIFY_DEPTH_KERNEL * 2.5066283f);
        }
    }
    for (int d = 0; d < DEPTH_ODDS_STEPS; d++) table[d] /= (float)fmax(total, 1);
}

static float table_at(const DepthOdds *places, const float *table, float log_depth)
{
    float x = (log_depth - places->min) / places->step;
    int d = x < 0 ? 0 : x > DEPTH_ODDS_STEPS - 2 ? DEPTH_ODDS_STEPS - 2 : (int)x;
    float f = fminf(fmaxf(x - (float)d, 0), 1);
    return table[d] * (1 - f) + table[d + 1] * f;
}

float fs_classify_depth_odds(const DepthOdds *odds, float log_depth)
{
    return table_at(odds, odds->odds, log_depth);
}

float fs_classify_slope_odds(float log_slope, float sigma)
{
    return own_odds(log_slope, fmaxf(sigma, CLASSIFY_SIGMA_MIN), LIT_SLOPE, LIT_SPREAD);
}

// The depths of clear points of either kind. At first the mirrored ones are those dull points where the clearly lit
// have no business; where these are too few every depth is as likely. They stay what they are: learnt again from the
// rounds' results they would confirm whatever those results are.
static void renew_depths(Graph *g, int round, float *weight)
{
    float even = 1 / (g->depths.step * (DEPTH_ODDS_STEPS - 1));
    for (int i = 0; i < g->n; i++) weight[i] = round == 0 && g->slope[i] < CLASSIFY_DULL_SLOPE ? 0 : g->p[i];
    depth_table(g, weight, g->table_lit);
    if (round == 0) {
        int alone = 0;
        for (int i = 0; i < g->n; i++) {
            weight[i] =
                g->p[i] < CLASSIFY_DULL && table_at(&g->depths, g->table_lit, g->log_depth[i]) < CLASSIFY_ALONE * even;
            alone += weight[i] > 0;
        }
        depth_table(g, weight, g->table_mirrored);
        for (int d = 0; d < DEPTH_ODDS_STEPS && alone <= CLASSIFY_ALONE_SHARE * g->n; d++) g->table_mirrored[d] = even;
    }
    for (int d = 0; d < DEPTH_ODDS_STEPS; d++) {
        float any = CLASSIFY_ANY_DEPTH * even, lit = (1 - CLASSIFY_ANY_DEPTH) * g->table_lit[d] + any,
              mirrored = (1 - CLASSIFY_ANY_DEPTH) * g->table_mirrored[d] + any, odds = logf(lit / mirrored);
        g->depths.odds[d] = fminf(fmaxf(odds, -CLASSIFY_DEPTH_MOST), CLASSIFY_DEPTH_MOST);
    }
    for (int i = 0; i < g->n; i++) g->depth_odds[i] = fs_classify_depth_odds(&g->depths, g->log_depth[i]);
}

static void round_job(void *context, int i, int worker)
{
    (void)worker;
    Graph *g = context;
    float lit = LIT_SLOPE * LIT_SUPPORT, support = LIT_SUPPORT, near = 0, ray = 0;
    for (int k = 0; k < GRAPH_FIELD; k++) {
        int j = g->field[(size_t)i * GRAPH_FIELD + (size_t)k];
        float w =
            g->field_weight[(size_t)i * GRAPH_FIELD + (size_t)k] * g->p[j] / (g->sigma[j] * g->sigma[j] + LIT_VARIANCE);
        lit += w * g->slope[j];
        support += w;
    }
    for (int k = 0; k < GRAPH_NEAR; k++) {
        size_t at = (size_t)i * GRAPH_NEAR + (size_t)k;
        near += g->near_weight[at] * (2 * g->p[g->near[at]] - 1);
    }
    for (int k = 0; k < GRAPH_RAY; k++) {
        size_t at = (size_t)i * GRAPH_RAY + (size_t)k;
        ray += g->ray_weight[at] * (2 * g->p[g->ray[at]] - 1);
    }
    float own = own_odds(g->slope[i], g->sigma[i], fmaxf(lit / support, LIT_LEAST),
                         support > LIT_FIELD_SUPPORT ? LIT_FIELD_SPREAD : LIT_SPREAD);
    g->evidence[i] = own + g->depths.rare + g->depth_odds[i] + CLASSIFY_NEAR_WEIGHT * near -
                     CLASSIFY_RAY_WEIGHT * fminf(fmaxf(ray, -CLASSIFY_RAY_MOST), CLASSIFY_RAY_MOST);
    g->p_next[i] = (1 - CLASSIFY_STEP) * g->p[i] + CLASSIFY_STEP * to_probability(g->evidence[i]);
}

static bool is_mirrored(const Graph *g, int i)
{
    // Dull points at depths of clearly lit ones stay out: mirrored, or lit too weakly to tell.
    return g->evidence[i] < -CLASSIFY_SURE && g->depth_odds[i] <= 0;
}

// What three quarters of the points called mirrored grow less than; m: how many these are. weight (n) is used up.
static float mirrored_slope(const Graph *g, float *weight, int *m)
{
    *m = 0;
    for (int i = 0; i < g->n; i++)
        if (is_mirrored(g, i)) weight[(*m)++] = g->slope[i];
    fs_order_floats(weight, (size_t)*m);
    return *m ? weight[3 * *m / 4] : 0;
}

static void settle(Graph *g, float *weight, Threads *threads)
{
    float lo = INFINITY, hi = -INFINITY;
    for (int i = 0; i < g->n; i++) {
        lo = fminf(lo, g->log_depth[i]);
        hi = fmaxf(hi, g->log_depth[i]);
        g->p[i] = to_probability(own_odds(g->slope[i], g->sigma[i], LIT_SLOPE, LIT_SPREAD));
    }
    g->depths.min = lo;
    g->depths.step = fmaxf((hi - lo) / (DEPTH_ODDS_STEPS - 1), 1e-6f);
    for (int round = 0; round < GRAPH_ROUNDS; round++) {
        renew_depths(g, round, weight);
        fs_threads_for(threads, g->n, round_job, g);
        memcpy(g->p, g->p_next, sizeof(float) * (size_t)g->n);
    }
}

// Where little is mirrored, lit points of which the flash says little outnumber the mirrored ones, and depths and
// neighbours then speak for these alone. So mirrored points are held for as rare as it takes for them to look mirrored;
// where none are left then, for as rare as lets some look most like it.
static int settle_all(Graph *g, Arena *arena, Threads *threads, FsError *err)
{
    float *weight = ARENA_NEW(arena, float, g->n), least = INFINITY, best = CLASSIFY_RARE_STEP;
    if (!weight) return fs_error_memory(err);
    for (int i = 0, m = 1; i <= CLASSIFY_RARE_STEPS && m > 0; i++) {
        g->depths.rare = (float)i * CLASSIFY_RARE_STEP;
        settle(g, weight, threads);
        float slope = mirrored_slope(g, weight, &m);
        bool looks_so = m > 0 && slope < MIRRORED_SLOPE_MOST;
        if (looks_so || (!i && m < MIRRORED_FEWEST)) return 0;
        if (i && m >= MIRRORED_LEFT && slope < least) {
            least = slope;
            best = g->depths.rare;
        }
    }
    g->depths.rare = best;
    settle(g, weight, threads);
    return 0;
}

int fs_classify_points(const SmallViews *views, SparsePoints *points, DepthOdds *depth_odds, Threads *threads,
                       FsError *err)
{
    int rc = 0, m = 0, n = points->n;
    const Cue *cue = points->cue;
    Arena arena = {0};
    Graph g;
    int *place_of = ARENA_NEW(&arena, int, (size_t)n + 1);
    TRY(graph_new(&g, n > 0 ? n : 1, &arena, err));
    for (int i = 0; i < n; i++) {
        points->kind[i] = POINT_UNSURE;
        float *place = g.place + 3 * (size_t)m;
        if (!cue[i].ok || !fs_small_views_direction(views, points->xyz + 3 * (size_t)i, place)) continue;
        g.log_depth[m] = place[2];
        place[2] *= CLASSIFY_DEPTH_SCALE;
        g.slope[m] = cue[i].log_slope;
        g.sigma[m] = fmaxf(cue[i].sigma, CLASSIFY_SIGMA_MIN);
        place_of[m++] = i;
    }
    g.n = m;
    *depth_odds = (DepthOdds){.step = 1};
    if (m > 0) {
        TRY(link_neighbours(&g, &arena, threads, err));
        TRY(settle_all(&g, &arena, threads, err));
        *depth_odds = g.depths;
        for (int d = 0; d < DEPTH_ODDS_STEPS; d++) depth_odds->odds[d] += g.depths.rare;
    }
    for (int j = 0; j < m; j++) {
        int i = place_of[j];
        if (g.evidence[j] > CLASSIFY_SURE) points->kind[i] = POINT_TRANSMITTED;
        if (is_mirrored(&g, j)) points->kind[i] = POINT_REFLECTED;
    }
fail:
    fs_arena_free(&arena);
    return rc;
}

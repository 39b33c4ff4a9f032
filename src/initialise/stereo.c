#include "initialise/stereo.h"

#include <math.h>
#include <stdlib.h>

#include "base/order.h"
#include "initialise/constants.h"
#include "initialise/seeds.h"
#include "initialise/semiglobal.h"
#include "initialise/plane_sweep.h"

static void map_free(DepthMap *map)
{
    free(map->layer[0]);
    free(map->layer[1]);
    free(map->guess);
    free(map->dull);
    *map = (DepthMap){0};
}

void fs_stereo_free(DepthMaps *maps)
{
    for (int k = 0; k < STEREO_VIEWS; k++) map_free(&maps->map[k]);
    *maps = (DepthMaps){0};
}

// Inverse depths between which the classified points lie in a view, and the number of steps.
static int find_range(const Start *start, int view, DepthRange *range, FsError *err)
{
    const SparsePoints *points = start->points;
    const Camera *camera = &start->views->view[view].camera;
    float *inverse = malloc(sizeof *inverse * ((size_t)points->n + 1));
    int m = 0;
    if (!inverse) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) {
        const float *xyz = points->xyz + 3 * (size_t)i;
        double p[3] = {xyz[0], xyz[1], xyz[2]}, pixel[2], z = fs_camera_project(camera, p, pixel);
        if (points->kind[i] != POINT_UNSURE && z > 0) inverse[m++] = (float)(1 / z);
    }
    fs_order_floats(inverse, (size_t)m);
    *range = (DepthRange){0};
    if (m > 0) {
        range->min = inverse[(int)(STEREO_RANGE_SHARE * (float)(m - 1))] * (1 - STEREO_RANGE_MARGIN);
        range->max = inverse[(int)((1 - STEREO_RANGE_SHARE) * (float)(m - 1))] * (1 + STEREO_RANGE_MARGIN);
        float spread_px = (range->max - range->min) * (float)(start->views->extent * start->views->focal_px);
        if (range->max > range->min)
            range->steps = (int)fminf(fmaxf(spread_px / STEREO_STEP_PX, STEREO_STEPS_MIN), STEREO_STEPS_MAX);
    }
    free(inverse);
    return 0;
}

typedef struct Match { // the maps of swept views, a job each
    PlaneSweep *sweep;
    DepthMap *map;
    bool reflected;
    bool failed; // out of memory
} Match;

static int nearest_step(const PlaneSweep *sweep, float step)
{
    int d = (int)(step + 0.5f);
    return d < 0 ? 0 : d >= sweep->steps ? sweep->steps - 1 : d;
}

// Chosen steps -> inverse depths, 0 where the score is below `sure`.
static void keep_sure(const PlaneSweep *sweep, const float *score, float sure, float *map)
{
    size_t n = (size_t)sweep->camera.width * (size_t)sweep->camera.height;
    for (size_t i = 0; i < n; i++) {
        int d = nearest_step(sweep, map[i]);
        float inverse = sweep->inverse_min + map[i] * sweep->inverse_step;
        bool inside = d > 0 && d < sweep->steps - 1;
        map[i] = inside && score[i * (size_t)sweep->steps + (size_t)d] > sure ? inverse : 0;
    }
}

// What the transmitted scene's chosen steps tell beyond where it is sure.
static void keep_guess(const PlaneSweep *s, DepthMap *map)
{
    size_t n = (size_t)s->camera.width * (size_t)s->camera.height;
    for (size_t i = 0; i < n; i++) {
        size_t at = i * (size_t)s->steps + (size_t)nearest_step(s, map->layer[0][i]);
        map->guess[i] = s->inverse_min + map->layer[0][i] * s->inverse_step;
        map->dull[i] = s->score[0][at] < s->score[1][at];
    }
}

static bool match_layer(PlaneSweep *s, bool reflected, DepthMap *map)
{
    static const struct {
        float small, large, sure;
    } costs[2] = {{STEREO_SMALL_T, STEREO_LARGE_T, STEREO_SURE_T}, {STEREO_SMALL_R, STEREO_LARGE_R, STEREO_SURE_R}};
    int width = s->camera.width, height = s->camera.height;
    float *score = s->score[reflected], *layer = map->layer[reflected];
    for (int i = 0; reflected && i < width * height; i++) // what is near the transmitted surface is that surface
        for (int d = 0; d < s->steps; d++)
            if (fabsf(s->inverse_min + (float)d * s->inverse_step - map->guess[i]) < STEREO_APART * map->guess[i])
                score[(size_t)i * (size_t)s->steps + (size_t)d] = 0;
    const ScoreVolume volume = {score, width, height, s->steps};
    if (fs_semiglobal_choose(&volume, costs[reflected].small, costs[reflected].large, layer, NULL) < 0) return false;
    if (!reflected) keep_guess(s, map);
    keep_sure(s, score, costs[reflected].sure, layer);
    return true;
}

static void match_job(void *context, int job, int worker)
{
    (void)worker;
    Match *w = context;
    PlaneSweep *s = &w->sweep[job];
    DepthMap *map = &w->map[job];
    size_t n = (size_t)s->camera.width * (size_t)s->camera.height;
    if (!s->steps) return;
    map->camera = s->camera;
    if (!map->layer[0]) map->layer[0] = malloc(sizeof(float) * n);
    if (!map->layer[1]) map->layer[1] = malloc(sizeof(float) * n);
    if (!map->guess) map->guess = malloc(sizeof(float) * n);
    if (!map->dull) map->dull = malloc(sizeof(bool) * n);
    bool done = map->layer[0] && map->layer[1] && map->guess && map->dull;
    if (!done || !match_layer(s, w->reflected, map)) __atomic_store_n(&w->failed, true, __ATOMIC_RELAXED);
}

// Inverse depth of a point in another view, and what that view's map says there (0: unsure; NAN: out of view).
static float depth_at(const DepthMap *map, const float *layer, const float xyz[3], float *inverse)
{
    double p[3] = {xyz[0], xyz[1], xyz[2]}, pixel[2], z = fs_camera_sees(&map->camera, p, pixel);
    if (!(z > 0)) return NAN;
    *inverse = (float)(1 / z);
    return layer[(size_t)pixel[1] * (size_t)map->camera.width + (size_t)pixel[0]];
}

// Views that agree, less those that see another surface of the same scene behind the point.
static int votes(const DepthMap *map, int n_maps, int own, bool reflected, const float xyz[3])
{
    int sum = 0;
    for (int k = 0; k < n_maps; k++) {
        float inverse = 0;
        if (k == own || !map[k].layer[0]) continue;
        float there = depth_at(&map[k], map[k].layer[reflected], xyz, &inverse);
        if (!(there > 0)) continue;
        float relative = inverse / there - 1;
        if (fabsf(relative) < STEREO_SAME_DEPTH)
            sum += 2;
        else if (relative > 0) // that view looks through the point
            sum -= 1;
        if (!reflected) continue;
        there = depth_at(&map[k], map[k].layer[0], xyz, &inverse);
        if (there > 0 && fabsf(inverse / there - 1) < STEREO_SAME_DEPTH) sum -= 2;
    }
    return sum;
}

int fs_stereo_fuse(const DepthMaps *maps, bool reflected, int least, PointList *points, FsError *err)
{
    int rc = 0;
    *points = (PointList){0};
    for (int k = 0; k < maps->n; k++) {
        const DepthMap *map = &maps->map[k];
        const float *layer = map->layer[reflected];
        if (!layer) continue;
        int width = map->camera.width, height = map->camera.height;
        for (int i = 0; i < width * height; i++) {
            float xyz[3];
            if (!(layer[i] > 0)) continue;
            fs_small_views_unproject(&map->camera, i % width + 0.5, (double)(i / width) + 0.5, 1 / (double)layer[i],
                                     xyz);
            if (votes(maps->map, maps->n, k, reflected, xyz) >= least) TRY(fs_points_append(points, xyz, err));
        }
    }
    return 0;
fail:
    fs_points_list_free(points);
    return rc;
}

// Sweeps the views and matches one scene, in the photos of `views`, with these odds of depths.
static int sweep_all(const Start *start, const SmallViews *views, const DepthOdds *odds, SweepAim aim, DepthMaps *maps,
                     FsError *err)
{
    int rc = 0;
    PlaneSweep sweep[STEREO_VIEWS] = {0};
    SweepPhotos photos = {0};
    TRY(fs_plane_sweep_prepare(views, aim, &photos, start->threads, err));
    for (int k = 0; k < maps->n; k++) {
        if (fs_log_cancelled(start->log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "initialise: stopped"));
        if (maps->range[k].steps > 0)
            TRY(fs_plane_sweep_run(&photos, maps->view[k], &maps->range[k], odds, start->threads, &sweep[k], err));
    }
    Match match = {sweep, maps->map, aim == AIM_REFLECTED, false};
    fs_threads_for(start->threads, maps->n, match_job, &match);
    if (match.failed) rc = fs_error_memory(err);
fail:
    for (int k = 0; k < STEREO_VIEWS; k++) fs_plane_sweep_free(&sweep[k]);
    fs_plane_sweep_photos_free(&photos);
    return rc;
}

int fs_stereo_find(const Start *start, DepthMaps *maps, FsError *err)
{
    const SmallViews *views = start->views;
    int rc = 0, *order = malloc(sizeof(int) * ((size_t)views->n + 1));
    if (!order) return fs_error_memory(err);
    *maps = (DepthMaps){.n = views->n < STEREO_VIEWS ? views->n : STEREO_VIEWS};
    TRY(fs_seeds_order(views, order, err));
    for (int k = 0; k < maps->n; k++) {
        maps->view[k] = order[k];
        TRY(find_range(start, order[k], &maps->range[k], err));
    }
    TRY(sweep_all(start, views, start->odds, AIM_TRANSMITTED, maps, err));
    TRY(sweep_all(start, views, start->odds, AIM_REFLECTED, maps, err)); // where T was not found
fail:
    free(order);
    if (rc < 0) fs_stereo_free(maps);
    return rc;
}

int fs_stereo_renew(const Start *start, const SmallViews *residual, SweepAim aim, float lit_odds, DepthMaps *maps,
                    FsError *err)
{
    DepthOdds odds = *start->odds;
    for (int i = 0; i < DEPTH_ODDS_STEPS; i++)
        if (odds.odds[i] > 0) odds.odds[i] *= lit_odds;
    return sweep_all(start, residual, &odds, aim, maps, err);
}

void fs_stereo_forget_dull(DepthMaps *maps)
{
    for (int k = 0; k < maps->n; k++) {
        DepthMap *map = &maps->map[k];
        size_t n = map->dull ? (size_t)map->camera.width * (size_t)map->camera.height : 0;
        for (size_t i = 0; i < n; i++)
            if (map->dull[i]) map->layer[0][i] = map->guess[i] = 0;
    }
}

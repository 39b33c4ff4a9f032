#include "initialise/dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "initialise/seeds.h"
#include "initialise/semiglobal.h"
#include "initialise/sweep.h"

enum {
    VIEWS = 8,  // swept
    DIVIDE = 2, // grid pixels per photo pixel, a side
    STEPS_MIN = 32,
    STEPS_MAX = 128,
};
#define STEP_PX 1.2f      // what a step of depth moves in a photo at the usual distance of photos
#define RANGE_MARGIN 0.15f
#define RANGE_SHARE 0.01f // of the points may lie outside the swept range at either end
#define SMALL_T 0.05f     // costs of a change of depth (semiglobal.h)
#define LARGE_T 0.3f
#define SMALL_R 0.03f
#define LARGE_R 0.2f
#define SURE_T 0.1f       // least scores
#define SURE_R 0.1f
#define SAME_DEPTH 0.04f  // relative; within this two views agree
#define APART 0.08f       // relative; the mirrored surface is not this near to the transmitted one on a ray

typedef struct DepthMap { // of one swept view; inverse depth, 0 where unsure; (height, width)
    Camera camera;
    float *transmitted, *reflected;
} DepthMap;

void fs_dense_free(DensePoints *points)
{
    free(points->xyz);
    *points = (DensePoints){0};
}

static int append(DensePoints *points, const float xyz[3], FsError *err)
{
    if (points->n == points->capacity) {
        int capacity = points->capacity ? 2 * points->capacity : 4096;
        float *grown = realloc(points->xyz, sizeof(float) * 3 * (size_t)capacity);
        if (!grown) return fs_error_memory(err);
        points->xyz = grown;
        points->capacity = capacity;
    }
    memcpy(points->xyz + 3 * (size_t)points->n++, xyz, sizeof(float) * 3);
    return 0;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Inverse depths between which the classified points lie in a view, and the number of steps.
static int find_range(const Frames *frames, int view, const float *xyz, const unsigned char *kind, int n, float *min,
                      float *max, int *steps, FsError *err)
{
    const Camera *camera = &frames->frame[view].camera;
    float *inverse = malloc(sizeof *inverse * ((size_t)n + 1));
    int m = 0;
    if (!inverse) return fs_error_memory(err);
    for (int i = 0; i < n; i++) {
        double p[3] = {xyz[3 * (size_t)i], xyz[3 * (size_t)i + 1], xyz[3 * (size_t)i + 2]}, pixel[2];
        double z = fs_camera_project(camera, p, pixel);
        if (kind[i] != POINT_UNSURE && z > 0) inverse[m++] = (float)(1 / z);
    }
    qsort(inverse, (size_t)m, sizeof *inverse, compare_floats);
    *steps = 0;
    if (m > 0) {
        *min = inverse[(int)(RANGE_SHARE * (float)(m - 1))] * (1 - RANGE_MARGIN);
        *max = inverse[(int)((1 - RANGE_SHARE) * (float)(m - 1))] * (1 + RANGE_MARGIN);
        float spread_px = (*max - *min) * (float)(frames->extent * frames->focal_px);
        *steps = (int)fminf(fmaxf(spread_px / STEP_PX, STEPS_MIN), STEPS_MAX);
    }
    free(inverse);
    return 0;
}

typedef struct Match { // one swept view's two surfaces, as a job
    Sweep *sweep;
    DepthMap *map;
    int *failed;
} Match;

// Chosen steps -> inverse depths, 0 where the score is below `sure`.
static void keep_sure(const Sweep *sweep, const float *score, float sure, float *map)
{
    size_t n = (size_t)sweep->camera.width * (size_t)sweep->camera.height;
    for (size_t i = 0; i < n; i++) {
        int d = (int)(map[i] + 0.5f);
        d = d < 0 ? 0 : d >= sweep->steps ? sweep->steps - 1 : d;
        float inverse = sweep->inverse_min + map[i] * sweep->inverse_step;
        bool inside = d > 0 && d < sweep->steps - 1;
        map[i] = inside && score[i * (size_t)sweep->steps + (size_t)d] > sure ? inverse : 0;
    }
}

static void match_job(void *context, int job, int worker)
{
    (void)worker;
    Match *w = context;
    Sweep *s = &w->sweep[job];
    DepthMap *map = &w->map[job];
    int width = s->camera.width, height = s->camera.height;
    size_t n = (size_t)width * (size_t)height;
    if (!s->steps) return;
    map->camera = s->camera;
    map->transmitted = malloc(sizeof(float) * n);
    map->reflected = malloc(sizeof(float) * n);
    w->failed[job] = !map->transmitted || !map->reflected ||
                     fs_semiglobal_choose(s->transmitted, width, height, s->steps, SMALL_T, LARGE_T, map->transmitted, NULL) < 0;
    if (w->failed[job]) return;
    for (size_t i = 0; i < n; i++) { // what is near the transmitted surface is that surface
        float T = s->inverse_min + map->transmitted[i] * s->inverse_step;
        for (int d = 0; d < s->steps; d++)
            if (fabsf(s->inverse_min + (float)d * s->inverse_step - T) < APART * T)
                s->reflected[i * (size_t)s->steps + (size_t)d] = 0;
    }
    w->failed[job] = fs_semiglobal_choose(s->reflected, width, height, s->steps, SMALL_R, LARGE_R, map->reflected, NULL) < 0;
    keep_sure(s, s->transmitted, SURE_T, map->transmitted);
    keep_sure(s, s->reflected, SURE_R, map->reflected);
}

// Inverse depth of a point in another view, and what that view's map says there (0: unsure; NAN: out of view).
static float look(const DepthMap *map, const float *layer, const float xyz[3], float *inverse)
{
    double p[3] = {xyz[0], xyz[1], xyz[2]}, pixel[2], z = fs_camera_project(&map->camera, p, pixel);
    if (!(z > 0 && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < map->camera.width && pixel[1] < map->camera.height))
        return NAN;
    *inverse = (float)(1 / z);
    return layer[(size_t)pixel[1] * (size_t)map->camera.width + (size_t)pixel[0]];
}

// Views that agree, less those that see another surface of the same scene behind the point.
static int votes(const DepthMap *map, int n_maps, int own, bool reflected, const float xyz[3])
{
    int sum = 0;
    for (int k = 0; k < n_maps; k++) {
        float inverse = 0;
        if (k == own || !map[k].transmitted) continue;
        float there = look(&map[k], reflected ? map[k].reflected : map[k].transmitted, xyz, &inverse);
        if (!(there > 0)) continue;
        float relative = inverse / there - 1;
        if (fabsf(relative) < SAME_DEPTH)
            sum += 2;
        else if (relative > 0) // that view looks through the point
            sum -= 1;
        if (!reflected) continue;
        there = look(&map[k], map[k].transmitted, xyz, &inverse);
        if (there > 0 && fabsf(inverse / there - 1) < SAME_DEPTH) sum -= 2;
    }
    return sum;
}

static int fuse(const DepthMap *map, int n_maps, bool reflected, DensePoints *points, FsError *err)
{
    int rc = 0;
    for (int k = 0; k < n_maps; k++) {
        const float *layer = reflected ? map[k].reflected : map[k].transmitted;
        if (!layer) continue;
        int width = map[k].camera.width, height = map[k].camera.height;
        for (int i = 0; i < width * height; i++) {
            float xyz[3];
            if (!(layer[i] > 0)) continue;
            fs_frames_unproject(&map[k].camera, i % width + 0.5, (double)(i / width) + 0.5, 1 / (double)layer[i], xyz);
            if (votes(map, n_maps, k, reflected, xyz) >= 2) TRY(append(points, xyz, err));
        }
    }
fail:
    return rc;
}

int fs_dense_find(const Frames *frames, const float *xyz, const unsigned char *kind, int n, const DepthOdds *odds,
                  const Log *log, Threads *threads, DensePoints *transmitted, DensePoints *reflected, FsError *err)
{
    int rc = 0, *order = malloc(sizeof(int) * ((size_t)frames->n + 1)), failed[VIEWS] = {0};
    int n_views = frames->n < VIEWS ? frames->n : VIEWS;
    Sweep sweep[VIEWS] = {0};
    DepthMap map[VIEWS] = {0};
    SweepPhotos photos = {0};
    *transmitted = *reflected = (DensePoints){0};
    if (!order) return fs_error_memory(err);
    TRY(fs_sweep_prepare(frames, &photos, threads, err));
    fs_seeds_order(frames, order);
    for (int k = 0; k < n_views; k++) {
        float min = 0, max = 0;
        int steps = 0;
        if (fs_log_cancelled(log)) {
            rc = fs_error_set(err, FS_ERR_CANCELLED, "initialise: stopped");
            goto fail;
        }
        TRY(find_range(frames, order[k], xyz, kind, n, &min, &max, &steps, err));
        if (steps > 0 && max > min)
            TRY(fs_sweep_view(frames, &photos, order[k], DIVIDE, min, max, steps, odds, threads, &sweep[k], err));
    }
    Match match = {sweep, map, failed};
    fs_threads_for(threads, n_views, match_job, &match);
    for (int k = 0; k < n_views; k++)
        if (failed[k]) {
            rc = fs_error_memory(err);
            goto fail;
        }
    TRY(fuse(map, n_views, false, transmitted, err));
    TRY(fuse(map, n_views, true, reflected, err));
fail:
    for (int k = 0; k < VIEWS; k++) {
        fs_sweep_free(&sweep[k]);
        free(map[k].transmitted);
        free(map[k].reflected);
    }
    fs_sweep_photos_free(&photos);
    free(order);
    if (rc < 0) {
        fs_dense_free(transmitted);
        fs_dense_free(reflected);
    }
    return rc;
}

// Depth errors: pairs of (truth, estimate) over all views, then medians.
#include "evaluate/depth.h"

#include <math.h>
#include <stdlib.h>

#include "base/order.h"
#include "image/profile.h"

typedef struct Pairs {
    float *truth, *estimate; // metres
    double *scratch;
    size_t n, capacity;
    size_t asked; // pixels with a true depth
} Pairs;

static int read_depth(const char *path, Image *depth, FsError *err)
{
    bool tiff = fs_file_has_ext(path, "tif tiff");
    int rc = tiff ? fs_tiff_read(path, depth, err) : fs_png_read(path, depth, err);
    if (rc < 0) return rc;
    if (depth->channels != 1) {
        rc = fs_error_input(err, "%s: %d channels, expected depth in one", path, depth->channels);
        fs_image_free(depth);
        return rc;
    }
    for (size_t i = 0; i < fs_image_pixels(depth) && !tiff; i++) depth->px[i] *= 65.535f; // 0..1 of 65535 mm
    return 0;
}

static int reserve(Pairs *pairs, size_t more, FsError *err)
{
    if (pairs->n + more <= pairs->capacity) return 0;
    size_t capacity = 2 * (pairs->n + more);
    float *t = realloc(pairs->truth, capacity * sizeof *t);
    if (t) pairs->truth = t;
    float *e = realloc(pairs->estimate, capacity * sizeof *e);
    if (e) pairs->estimate = e;
    double *s = realloc(pairs->scratch, capacity * sizeof *s);
    if (s) pairs->scratch = s;
    if (!t || !e || !s) return fs_error_memory(err);
    pairs->capacity = capacity;
    return 0;
}

static float nearest(const Image *image, int x, int y, int width, int height)
{
    int sx = (int)((x + 0.5) * image->width / width), sy = (int)((y + 0.5) * image->height / height);
    return *fs_image_at(image, sx, sy);
}

static int collect(Pairs *pairs, const char *truth_path, const char *path, FsError *err)
{
    Image truth = {0}, depth = {0};
    int rc;
    TRY(read_depth(truth_path, &truth, err));
    TRY(read_depth(path, &depth, err));
    TRY(fs_truth_same_shape(&truth, &depth, path, err));
    int width = truth.width < depth.width ? truth.width : depth.width;
    int height = truth.height < depth.height ? truth.height : depth.height;
    TRY(reserve(pairs, (size_t)width * (size_t)height, err));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float t = nearest(&truth, x, y, width, height), d = nearest(&depth, x, y, width, height);
            if (!(t > 0)) continue;
            pairs->asked++;
            if (!(d > 0) || !isfinite(d)) continue;
            pairs->truth[pairs->n] = t;
            pairs->estimate[pairs->n++] = d;
        }
fail:
    fs_image_free(&truth);
    fs_image_free(&depth);
    return rc;
}

// Another program's picture of depth, as for eyes, is no depth.
static bool is_depth(const char *path)
{
    Image depth;
    LightTag tag = {0};
    bool tiff = fs_file_has_ext(path, "tif tiff");
    if (!tiff && (fs_png_read_tag(path, &tag, NULL) < 0 || !tag.deep)) return false;
    if (read_depth(path, &depth, NULL) < 0) return false;
    fs_image_free(&depth);
    return true;
}

// Of n > 0 values; sorts them.
static double median(double *values, size_t n)
{
    fs_order_doubles(values, n);
    return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

static double relative_error(const Pairs *pairs, size_t first, double scale)
{
    size_t n = pairs->n - first;
    double *values = pairs->scratch;
    if (n == 0) return NAN;
    for (size_t i = 0; i < n; i++)
        values[i] = fabs(scale * pairs->estimate[first + i] - pairs->truth[first + i]) / pairs->truth[first + i];
    return median(values, n);
}

static int view_score(DepthViewScore *view, const TruthView *truth, FilePath path, Pairs *pairs, FsError *err)
{
    snprintf(view->name, sizeof view->name, "%s", truth->name);
    view->error = view->covered = NAN;
    view->missing = !*path.text;
    if (view->missing) return 0;
    size_t first = pairs->n, asked = pairs->asked;
    MUST(collect(pairs, truth->path.text, path.text, err));
    view->error = relative_error(pairs, first, 1);
    if (pairs->asked > asked) view->covered = (double)(pairs->n - first) / (double)(pairs->asked - asked);
    return 0;
}

static void summarise(DepthScore *score, const Pairs *pairs)
{
    score->error = score->scale = score->error_scaled = NAN;
    score->covered = pairs->asked ? (double)pairs->n / (double)pairs->asked : NAN;
    if (pairs->n == 0) return;
    score->error = relative_error(pairs, 0, 1);
    for (size_t i = 0; i < pairs->n; i++) pairs->scratch[i] = (double)pairs->truth[i] / pairs->estimate[i];
    score->scale = median(pairs->scratch, pairs->n);
    score->error_scaled = relative_error(pairs, 0, score->scale);
}

int fs_depth_score(DepthScore *score, const char *layer, const TruthViews *views, const char *dir, const Log *log,
                   bool ours, FsError *err)
{
    *score = (DepthScore){.layer = layer};
    Pairs pairs = {0};
    int rc = 0, none = 0;
    score->view = calloc((size_t)views->n + 1, sizeof *score->view);
    if (!score->view) return fs_error_memory(err);
    for (int i = 0; i < views->n; i++) {
        FilePath path;
        bool there = fs_truth_find(dir, layer, views->view[i].name, "png|tif|tiff", &path),
             is = ours || (there && is_depth(path.text));
        if (!there || !is) path.text[0] = 0;
        none += there && !is;
        TRY(view_score(&score->view[i], &views->view[i], path, &pairs, err));
        score->missing += score->view[i].missing;
    }
    score->n = views->n - score->missing;
    if (none)
        fs_log_warn(log,
                    "evaluate: %d pictures in %s/%s are no depth (16-bit PNG in millimetres, or float TIFF): left out",
                    none, dir, layer);
    if (score->missing)
        fs_log_warn(log, "evaluate: %d of %d views are missing in %s/%s", score->missing, views->n, dir, layer);
    summarise(score, &pairs);
fail:
    free(pairs.truth);
    free(pairs.estimate);
    free(pairs.scratch);
    if (rc < 0) fs_depth_free(score);
    return rc;
}

void fs_depth_free(DepthScore *score)
{
    free(score->view);
    *score = (DepthScore){0};
}

// Passes over the views: the gain that fits the layer best; the metrics without and with it, views side by side; last
// the metrics that need all threads for one picture, view by view.
#include "evaluate/score.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/tone.h"

#define PICTURES "png|jpg|jpeg"

typedef struct Task {
    const TruthView *truth; // of this view
    const char *truth_dir;
    FilePath estimate;
    bool paired;
    Encoding encoding;
    const double *gain; // NULL in the first pass
    const MetricContext *context;
    bool threaded;              // the last pass: the metrics that are threaded in themselves
    double cross[3], square[3]; // sums of truth * estimate and estimate^2, linear
    ViewScore *score;
    FsError err;
} Task;

static void fit_one(Task *task, const Image *a, const Image *b)
{
    for (size_t i = 0; i < fs_image_values(a); i++) {
        double x = fs_tone_decode(a->px[i]), y = fs_tone_decode(b->px[i]);
        task->cross[i % 3] += x * y;
        task->square[i % 3] += y * y;
    }
}

static int measure(const Task *task, const Image *a, const Image *b, Figures *figures, FsError *err)
{
    int rc = 0;
    for (int m = 0; m < METRICS && rc == 0; m++)
        if (fs_metrics[m].threaded == task->threaded)
            rc = fs_metrics[m].measure(a, b, task->context, &figures->value[m], err);
    return rc;
}

static void stretch(Image *image)
{
    size_t n = fs_image_values(image);
    float low = image->px[0], high = low;
    for (size_t i = 0; i < n; i++) low = fminf(low, image->px[i]), high = fmaxf(high, image->px[i]);
    for (size_t i = 0; i < n; i++) image->px[i] = high > low ? (image->px[i] - low) / (high - low) : 0.0f;
}

// gamma(I_F - I_N) of the true composites, or where they lack this view of the true T_F and T_N, since what is mirrored
// hardly differs; *there false when these do, too.
static int paired_difference(const Task *task, Image *difference, bool *there, FsError *err)
{
    static const char *const pairs[][2] = {{"I_F", "I_N"}, {"T_F", "T_N"}};
    Image flash, ambient;
    FilePath path_f, path_n;
    *there = false;
    for (int i = 0; i < 2 && !*there; i++)
        *there = fs_truth_find(task->truth_dir, pairs[i][0], task->truth->name, PICTURES, &path_f) &&
                 fs_truth_find(task->truth_dir, pairs[i][1], task->truth->name, PICTURES, &path_n);
    if (!*there) return 0;
    MUST(fs_truth_read_pair(path_f.text, path_n.text, ENCODING_GAMMA, &flash, &ambient, err));
    for (size_t i = 0; i < fs_image_values(&flash); i++) // negative differences become 0
        flash.px[i] = fs_tone_encode(fs_tone_decode(flash.px[i]) - fs_tone_decode(ambient.px[i]));
    *difference = flash;
    fs_image_free(&ambient);
    return 0;
}

static int measure_paired(const Task *task, Image *estimate, Figures *figures, FsError *err)
{
    Image difference = {0};
    bool there;
    int rc;
    TRY(paired_difference(task, &difference, &there, err));
    if (!there) goto fail;
    TRY(fs_truth_same_size(&difference, estimate, task->estimate.text, err));
    stretch(&difference);
    stretch(estimate);
    TRY(measure(task, &difference, estimate, figures, err));
fail:
    fs_image_free(&difference);
    return rc;
}

static void score_view(void *context, int job, int worker)
{
    (void)worker;
    Task *task = (Task *)context + job;
    Image a = {0}, b = {0}, fitted = {0};
    int rc = 0;
    if (task->score->missing) return;
    TRY(fs_truth_read_pair(task->truth->path.text, task->estimate.text, task->encoding, &a, &b, &task->err));
    task->score->width = a.width, task->score->height = a.height;
    if (!task->gain) {
        fit_one(task, &a, &b);
        goto fail;
    }
    TRY(measure(task, &a, &b, &task->score->figures[SCORE_RAW], &task->err));
    TRY(fs_image_copy(&fitted, &b, &task->err));
    for (size_t i = 0; i < fs_image_values(&b); i++)
        fitted.px[i] = fs_tone_encode((float)fmin(fs_tone_decode(b.px[i]) * task->gain[i % 3], 1));
    TRY(measure(task, &a, &fitted, &task->score->figures[SCORE_FITTED], &task->err));
    if (task->paired) TRY(measure_paired(task, &b, &task->score->figures[SCORE_PAPER], &task->err));
fail:
    fs_image_free(&a);
    fs_image_free(&b);
    fs_image_free(&fitted);
}

static int first_error(const Task *tasks, int n, FsError *err)
{
    for (int i = 0; i < n; i++)
        if (tasks[i].err.code) return fs_error_set(err, tasks[i].err.code, "%s", tasks[i].err.message);
    return 0;
}

static int run_pass(Task *tasks, int n, const double *gain, const MetricContext *context, FsError *err)
{
    for (int i = 0; i < n; i++) tasks[i].gain = gain, tasks[i].context = context;
    fs_threads_for(context->threads, n, score_view, tasks);
    return first_error(tasks, n, err);
}

static int run_threaded(Task *tasks, int n, const Log *log, FsError *err)
{
    for (int i = 0; i < n; i++) {
        if (fs_log_cancelled(log)) return fs_error_set(err, FS_ERR_CANCELLED, "evaluate: stopped");
        tasks[i].threaded = true;
        score_view(tasks, i, 0);
    }
    return first_error(tasks, n, err);
}

static void find_size(LayerScore *score)
{
    for (int i = 0; i < score->n + score->missing; i++) {
        const ViewScore *v = &score->view[i];
        if (v->missing || (score->width && score->width <= v->width)) continue;
        score->width = v->width, score->height = v->height;
    }
}

static void find_mean(LayerScore *score, int kind)
{
    double *mean = score->mean[kind].value;
    int *n = &score->counted[kind];
    for (int i = 0; i < score->n + score->missing; i++) {
        const double *value = score->view[i].figures[kind].value;
        if (score->view[i].missing || isnan(value[METRIC_PSNR])) continue;
        for (int m = 0; m < METRICS; m++) mean[m] += value[m];
        *n += 1;
    }
    for (int m = 0; m < METRICS; m++) mean[m] = *n ? mean[m] / *n : NAN;
}

// The picture of a view, where there is one.
static int find_estimate(const LayerTask *layer, const char *view, FilePath *path, bool *there, FsError *err)
{
    int found = layer->cameras ? fs_truth_find_estimate(layer->dir, layer->layer, layer->cameras, view, path)
                               : fs_truth_find(layer->dir, layer->layer, view, FS_TRUTH_PICTURES, path);
    *there = found == 1;
    if (found <= 1) return 0;
    return fs_error_input(err, "%s/%s: %d pictures may be of %s (%s is one); leave the one that is meant, as %s.png",
                          layer->dir, layer->layer, found, view, fs_file_name(path->text), view);
}

static int make_tasks(LayerScore *score, const LayerTask *layer, Task *tasks, FsError *err)
{
    const TruthViews *views = layer->views;
    for (int i = 0; i < views->n; i++) {
        ViewScore *view = &score->view[i];
        for (int k = 0; k < SCORE_KINDS; k++)
            for (int m = 0; m < METRICS; m++) view->figures[k].value[m] = NAN;
        memcpy(view->name, views->view[i].name, sizeof view->name);
        tasks[i] = (Task){.truth = &views->view[i],
                          .truth_dir = layer->truth,
                          .paired = layer->paired,
                          .encoding = layer->encoding,
                          .score = view};
        bool there;
        MUST(find_estimate(layer, view->name, &tasks[i].estimate, &there, err));
        view->missing = !there;
        score->missing += view->missing;
    }
    score->n = views->n - score->missing;
    return 0;
}

static void warn_missing(const LayerScore *score, const char *dir, const Log *log)
{
    for (int i = 0; i < score->n + score->missing; i++) {
        if (!score->view[i].missing) continue;
        fs_log_warn(log, "evaluate: %d of %d views are missing, the first one %s/%s/%s.png", score->missing,
                    score->n + score->missing, dir, score->layer, score->view[i].name);
        return;
    }
}

int fs_score_layer(LayerScore *score, const LayerTask *layer, const MetricContext *context, const Log *log,
                   FsError *err)
{
    const TruthViews *views = layer->views;
    *score = (LayerScore){.layer = layer->layer, .gain = {NAN, NAN, NAN}};
    int rc = 0;
    Task *tasks = calloc((size_t)views->n + 1, sizeof *tasks);
    score->view = calloc((size_t)views->n + 1, sizeof *score->view);
    if (!tasks || !score->view) TRY(fs_error_memory(err));
    TRY(make_tasks(score, layer, tasks, err));
    warn_missing(score, layer->dir, log);
    TRY(run_pass(tasks, views->n, NULL, context, err));
    for (int c = 0; c < 3 && score->n; c++) {
        double cross = 0, square = 0;
        for (int i = 0; i < views->n; i++) cross += tasks[i].cross[c], square += tasks[i].square[c];
        score->gain[c] = cross / fmax(square, 1e-12);
    }
    TRY(run_pass(tasks, views->n, score->gain, context, err));
    if (context->lpips) TRY(run_threaded(tasks, views->n, log, err));
    find_size(score);
    for (int k = 0; k < SCORE_KINDS; k++) find_mean(score, k);
fail:
    free(tasks);
    if (rc < 0) fs_score_free(score);
    return rc;
}

void fs_score_free(LayerScore *score)
{
    free(score->view);
    *score = (LayerScore){0};
}

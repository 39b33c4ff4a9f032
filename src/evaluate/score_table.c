// The table and the JSON, both driven by the table of metrics.
#include "evaluate/score_table.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/json_file.h"

// The three ways a layer is measured.
static const struct {
    const char *title, *suffix; // suffix: of the names in JSON
} kinds[SCORE_KINDS] = {{"as it is", ""}, {"gain-fitted", "_gain"}, {"paper's convention", "_paper"}};

// ---- table ----

typedef struct Columns {
    int width[METRICS]; // 0: a metric without any value has no column
    int n_kinds;        // the paper's convention last, where measured
} Columns;

static Columns columns_of(const MethodScore *method)
{
    Columns columns = {.n_kinds = SCORE_PAPER};
    for (int l = 0; l < FS_EVALUATE_LAYERS; l++) {
        const LayerScore *layer = &method->layer[l];
        for (int m = 0; m < METRICS && layer->n; m++)
            if (!isnan(layer->mean[SCORE_RAW].value[m]))
                columns.width[m] = (int)fmax(6, (double)strlen(fs_metrics[m].title));
        if (layer->counted[SCORE_PAPER]) columns.n_kinds = SCORE_KINDS;
    }
    return columns;
}

static void print_layer(FILE *f, const Columns *columns, const LayerScore *layer)
{
    fprintf(f, "%-5s %5d", layer->layer, layer->n);
    for (int k = 0; k < columns->n_kinds; k++) {
        if (k == SCORE_PAPER && !layer->counted[k]) break;
        fprintf(f, " |");
        for (int m = 0; m < METRICS; m++) {
            char text[64] = "-";
            double value = layer->mean[k].value[m];
            if (!isnan(value)) snprintf(text, sizeof text, fs_metrics[m].format, value);
            if (columns->width[m]) fprintf(f, " %*s", columns->width[m], text);
        }
        if (k == SCORE_FITTED) fprintf(f, "  %5.3f %5.3f %5.3f", layer->gain[0], layer->gain[1], layer->gain[2]);
    }
}

static void print_titles(FILE *f, const Columns *columns)
{
    fprintf(f, "%-5s %5s", "layer", "views");
    for (int k = 0; k < columns->n_kinds; k++) {
        fprintf(f, " |");
        for (int m = 0; m < METRICS; m++)
            if (columns->width[m]) fprintf(f, " %*s", columns->width[m], fs_metrics[m].title);
        if (k == SCORE_FITTED) fprintf(f, "  %-17s", "gain");
    }
}

static void print_groups(FILE *f, const Columns *columns)
{
    int width = -1;
    for (int m = 0; m < METRICS; m++) width += columns->width[m] ? 1 + columns->width[m] : 0;
    fprintf(f, "%-11s", "");
    for (int k = 0; k < columns->n_kinds; k++)
        fprintf(f, " | %-*s", width + (k == SCORE_FITTED ? 19 : 0), kinds[k].title);
}

enum { LINE = 2000 }; // as long as the log's

static FILE *begin_line(char line[LINE])
{
    memset(line, 0, LINE);
    FILE *f = fmemopen(line, LINE - 1, "w");
    if (!f) fs_error_memory(NULL); // the line is left out: the stage is not done
    return f;
}

static void end_line(FILE *f, char line[LINE], const Log *log)
{
    fclose(f);
    for (size_t n = strlen(line); n && line[n - 1] == ' '; n--) line[n - 1] = 0;
    fs_log_info(log, "%s", line);
}

static void log_method(const MethodScore *method, const Log *log)
{
    Columns columns = columns_of(method);
    bool any = false;
    for (int l = 0; l < FS_EVALUATE_LAYERS; l++) any |= method->layer[l].n > 0;
    fs_log_info(log, "%s (%s)%s", method->name, method->dir.text, any ? "" : ": no layer to measure");
    char line[LINE];
    for (int l = -2; l < FS_EVALUATE_LAYERS && any; l++) {
        FILE *f = l >= 0 && !method->layer[l].n ? NULL : begin_line(line);
        if (!f) continue;
        if (l == -2) print_groups(f, &columns);
        if (l == -1) print_titles(f, &columns);
        if (l >= 0) print_layer(f, &columns, &method->layer[l]);
        end_line(f, line, log);
    }
    for (int k = 0; k < FS_EVALUATE_DEPTHS; k++) {
        const DepthScore *d = &method->depth[k];
        if (d->n)
            fs_log_info(log,
                        "%s, %d views: median relative error %.2f %%; after the scale %.4f, %.2f %%; %.1f %% of pixels",
                        d->layer, d->n, 100 * d->error, d->scale, 100 * d->error_scaled, 100 * d->covered);
    }
}

// Figures of fewer views, or of smaller pictures, which show fewer faults, are not to be compared with the others.
static void warn_unlike(const MethodScore *methods, int n, int l, const Log *log)
{
    const LayerScore *first = NULL;
    int at = 0;
    for (int i = 0; i < n; i++) {
        const LayerScore *s = &methods[i].layer[l];
        if (!s->n) continue;
        if (!first) first = s, at = i;
        if (s->n == first->n && s->width == first->width && s->height == first->height) continue;
        fs_log_warn(log,
                    "evaluate: %s of %s was measured at %d views of %d x %d pixels, that of %s at %d of %d x %d: fewer "
                    "views, or smaller pictures, may score higher for that alone",
                    s->layer, methods[at].name, first->n, first->width, first->height, methods[i].name, s->n, s->width,
                    s->height);
    }
}

// Methods side by side: gain-fitted means.
static void log_comparison(const MethodScore *methods, int n, const Log *log)
{
    char line[LINE];
    fs_log_info(log, "gain-fitted PSNR / SSIM, side by side");
    for (int l = -1; l < FS_EVALUATE_LAYERS; l++) { // -1: the heading
        const char *name = l < 0 ? "layer" : NULL;
        for (int i = 0; i < n && l >= 0; i++)
            if (methods[i].layer[l].n) name = methods[i].layer[l].layer;
        FILE *f = name ? begin_line(line) : NULL;
        if (!f) continue;
        fprintf(f, "%-5s", name);
        for (int i = 0; i < n; i++) {
            const LayerScore *s = l < 0 ? NULL : &methods[i].layer[l];
            if (s && s->n)
                fprintf(f, " | %5.2f / %.4f", s->mean[SCORE_FITTED].value[METRIC_PSNR],
                        s->mean[SCORE_FITTED].value[METRIC_SSIM]);
            else
                fprintf(f, " | %-14.14s", s ? "-" : methods[i].name);
        }
        end_line(f, line, log);
    }
}

void fs_score_table_log(const MethodScore *methods, int n, const Log *log)
{
    for (int i = 0; i < n; i++) log_method(&methods[i], log);
    if (n > 1) log_comparison(methods, n, log);
    for (int l = 0; l < FS_EVALUATE_LAYERS; l++) warn_unlike(methods, n, l, log);
}

// ---- JSON ----

static void put_number(json_t *object, const char *name, double value)
{
    if (isfinite(value)) json_object_set_new(object, name, json_real(value));
}

static void put_figures(json_t *object, const Figures *figures, const char *suffix)
{
    for (int m = 0; m < METRICS; m++) {
        char name[64];
        snprintf(name, sizeof name, "%s%s", fs_metrics[m].name, suffix);
        put_number(object, name, figures->value[m]);
    }
}

static json_t *layer_json(const LayerScore *layer)
{
    json_t *root = json_pack("{s:i, s:i, s:i, s:i}", "n", layer->n, "missing", layer->missing, "width", layer->width,
                             "height", layer->height),
           *views = json_object();
    for (int k = 0; k < SCORE_KINDS; k++) put_figures(root, &layer->mean[k], kinds[k].suffix);
    if (layer->n) json_object_set_new(root, "gain", json_pack("[fff]", layer->gain[0], layer->gain[1], layer->gain[2]));
    for (int i = 0; i < layer->n + layer->missing; i++) {
        const ViewScore *v = &layer->view[i];
        json_t *view = json_object();
        for (int k = 0; k < SCORE_KINDS; k++) put_figures(view, &v->figures[k], kinds[k].suffix);
        if (v->missing) json_object_set_new(view, "missing", json_true());
        json_object_set_new(views, v->name, view);
    }
    json_object_set_new(root, "views", views);
    return root;
}

static json_t *depth_json(const DepthScore *depth)
{
    json_t *root = json_pack("{s:i, s:i}", "n", depth->n, "missing", depth->missing), *views = json_object();
    put_number(root, "median_relative_error", depth->error);
    put_number(root, "scale", depth->scale);
    put_number(root, "median_relative_error_scaled", depth->error_scaled);
    put_number(root, "covered", depth->covered);
    for (int i = 0; i < depth->n + depth->missing; i++) {
        json_t *view = json_object();
        put_number(view, "median_relative_error", depth->view[i].error);
        put_number(view, "covered", depth->view[i].covered);
        json_object_set_new(views, depth->view[i].name, view);
    }
    json_object_set_new(root, "views", views);
    return root;
}

int fs_score_table_write(const MethodScore *methods, int n, const char *truth, const char *views, const char *path,
                         FsError *err)
{
    json_t *all = json_object();
    for (int i = 0; i < n; i++) {
        json_t *layers = json_object(), *method = json_object();
        json_object_set_new(method, "dir", json_string(methods[i].dir.text));
        for (int l = 0; l < FS_EVALUATE_LAYERS; l++)
            if (methods[i].layer[l].layer)
                json_object_set_new(layers, methods[i].layer[l].layer, layer_json(&methods[i].layer[l]));
        json_object_set_new(method, "layers", layers);
        for (int k = 0; k < FS_EVALUATE_DEPTHS; k++)
            if (methods[i].depth[k].layer)
                json_object_set_new(method, methods[i].depth[k].layer, depth_json(&methods[i].depth[k]));
        json_object_set_new(all, methods[i].name, method);
    }
    json_t *root =
        json_pack("{s:o*, s:o*, s:o}", "truth", json_string(truth), "views", json_string(views), "methods", all);
    return fs_json_file_write(path, root, JSON_INDENT(1) | JSON_REAL_PRECISION(9), err);
}

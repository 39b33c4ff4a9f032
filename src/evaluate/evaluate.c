// Evaluation: every method's folder against every layer the truth has.
#include "evaluate/evaluate.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "evaluate/score_table.h"
#include "model/layers.h"
#include "model/rendered_from.h"

static const struct {
    RenderLayer layer;
    bool transmitted; // measured in the paper's convention too
} layers[FS_EVALUATE_LAYERS] = {
    {RENDER_T_N, true}, {RENDER_T_F, true}, {RENDER_R, false}, {RENDER_I_N, false}, {RENDER_I_F, false}};

typedef struct Evaluation {
    FsProject *project;
    const char *truth;
    Dataset cameras;
    Lpips *lpips;
    MetricContext context;
    MethodScore *method;
    int n;
} Evaluation;

static int add_method(Evaluation *e, const char *name, size_t name_length, const char *dir, size_t dir_length,
                      FsError *err)
{
    MethodScore *method = &e->method[e->n++];
    method->name = strndup(name, name_length);
    method->dir = fs_file_at("%.*s", (int)dir_length, dir);
    if (!method->name) return fs_error_memory(err);
    for (int i = 0; i < e->n - 1; i++)
        if (strcmp(e->method[i].name, method->name) == 0)
            return fs_error_set(err, FS_ERR_USAGE, "--method: the name '%s' is taken twice", method->name);
    if (fs_file_is_dir(method->dir.text)) return 0;
    if (e->n == 1 && !*e->project->set.output)
        return fs_project_missing(e->project->out, FS_STAGE_RENDER, "renders", err);
    return fs_error_input(err, "%s: no such folder: %s expects <layer>/<view>.png in it", method->dir.text,
                          e->n == 1 ? "--output DIR" : "--method NAME=DIR");
}

// This project's renders first, then NAME=DIR,NAME=DIR.
static int list_methods(Evaluation *e, FsError *err)
{
    const Settings *set = &e->project->set;
    size_t most = 2;
    for (const char *p = set->methods; *p; p++) most += *p == ',';
    e->method = calloc(most, sizeof *e->method);
    if (!e->method) return fs_error_memory(err);
    FilePath own = *set->output ? fs_file_at("%s", set->output) : fs_file_at("%s/renders", e->project->out);
    int rc = add_method(e, "flashsplat", 10, own.text, strlen(own.text), err);
    for (const char *p = set->methods; *p && rc == 0;) {
        size_t n = strcspn(p, ","), name = strcspn(p, "=");
        if (name == 0 || name + 1 >= n)
            return fs_error_set(err, FS_ERR_USAGE, "--method: '%.*s' is not NAME=DIR", (int)n, p);
        rc = add_method(e, p, name, p + name + 1, n - name - 1, err);
        p += n + (p[n] == ',');
    }
    return rc;
}

static int evaluate_layer(Evaluation *e, int l, FsError *err)
{
    const char *name = fs_render_layers[layers[l].layer].name;
    TruthViews views;
    int rc = fs_truth_list(e->truth, name, &e->cameras, e->project->set.views, &views, err);
    if (rc < 0) return rc;
    if (!views.n)
        fs_log_info(&e->project->log, "evaluate: the truth has no %s at %s views, skipped", name,
                    e->project->set.views);
    for (int i = 0; i < e->n && views.n; i++) {
        TRY(fs_log_cancelled(&e->project->log) ? fs_error_set(err, FS_ERR_CANCELLED, "evaluate: stopped") : 0);
        fs_log_progress(&e->project->log, "evaluate", l * e->n + i, FS_EVALUATE_LAYERS * e->n, name);
        Encoding encoding = i ? fs_truth_encoding(e->project->set.method_encoding) : ENCODING_GAMMA;
        LayerTask task = {.layer = name,
                          .truth = e->truth,
                          .dir = e->method[i].dir.text,
                          .views = &views,
                          .cameras = i ? &e->cameras : NULL,
                          .paired = layers[l].transmitted,
                          .encoding = encoding};
        TRY(fs_score_layer(&e->method[i].layer[l], &task, &e->context, &e->project->log, err));
    }
fail:
    fs_truth_free(&views);
    return rc;
}

static int evaluate_depth(Evaluation *e, int k, FsError *err)
{
    static const RenderLayer depths[FS_EVALUATE_DEPTHS] = {RENDER_DEPTH_T, RENDER_DEPTH_R};
    const char *name = fs_render_layers[depths[k]].name;
    TruthViews views;
    int rc = fs_truth_list(e->truth, name, &e->cameras, e->project->set.views, &views, err);
    for (int i = 0; i < e->n && rc == 0 && views.n; i++)
        rc = fs_depth_score(&e->method[i].depth[k], name, &views, e->method[i].dir.text, &e->project->log, !i, err);
    fs_truth_free(&views);
    return rc;
}

static int finish(const Evaluation *e, FsError *err)
{
    const Settings *set = &e->project->set;
    fs_score_table_log(e->method, e->n, &e->project->log);
    FilePath path = fs_file_at("%s/evaluate.json", e->project->out);
    MUST(fs_score_table_write(e->method, e->n, e->truth, set->views, path.text, err));
    if (*set->json) MUST(fs_score_table_write(e->method, e->n, e->truth, set->views, set->json, err));
    fs_log_info(&e->project->log, "evaluate: figures of every view in %s", *set->json ? set->json : path.text);
    return fs_project_mark_done(e->project, FS_STAGE_EVALUATE, err);
}

static int open_lpips(Evaluation *e, FsError *err)
{
    const char *path = e->project->set.lpips_weights;
    if (!*path) {
        fs_log_info(&e->project->log, "evaluate: LPIPS is not measured: it needs --lpips-weights FILE, which "
                                      "tools/lpips_convert.py makes out of PyTorch's files (docs/lpips.md)");
        return 0;
    }
    int rc = fs_lpips_read(&e->lpips, path, err);
    e->context.lpips = e->lpips;
    return rc;
}

// Renders in the project's own folder are of the clouds that are there now: no old figures under a new mark. Those that
// were kept elsewhere may be of others.
static int check_renders(const FsProject *project, FsError *err)
{
    const char *elsewhere = project->set.output;
    FilePath dir = *elsewhere ? fs_file_at("%s", elsewhere) : fs_file_at("%s/renders", project->out);
    FilePath layer = fs_file_at("%s/%s", dir.text, fs_render_layers[RENDER_T_N].name);
    FilePath model = fs_file_at("%s/clouds/model.json", project->out);
    RenderedFrom from = fs_rendered_from_ask(project, dir.text);
    if (*elsewhere && from == RENDERED_FROM_OTHERS)
        fs_log_warn(&project->log, "%s: of another training than the clouds in %s, and so are these figures", dir.text,
                    project->out);
    bool marked = fs_file_exists(fs_file_at("%s/done/render.json", project->out).text);
    if (from == RENDERED_FROM_UNKNOWN && !marked && fs_file_is_older(layer.text, model.text))
        from = RENDERED_FROM_OTHERS;
    if (*elsewhere || from != RENDERED_FROM_OTHERS) return 0;
    return fs_error_input(err, "%s: of an earlier training: render first (flashsplat render %s)", dir.text,
                          project->out);
}

static int count_pictures(const Evaluation *e, int method, int *count, FsError *err)
{
    FilePath path;
    const char *dir = e->method[method].dir.text;
    *count = 0;
    for (int l = 0; l < FS_EVALUATE_LAYERS; l++) {
        const char *layer = fs_render_layers[layers[l].layer].name;
        TruthViews views;
        MUST(fs_truth_list(e->truth, layer, &e->cameras, e->project->set.views, &views, err));
        for (int v = 0; v < views.n; v++)
            *count += method ? fs_truth_find_estimate(dir, layer, &e->cameras, views.view[v].name, &path)
                             : fs_truth_find(dir, layer, views.view[v].name, FS_TRUTH_PICTURES, &path);
        fs_truth_free(&views);
    }
    return 0;
}

// Before the figures that are there are given up: something must be there to be measured.
static int check_pictures(const Evaluation *e, FsError *err)
{
    int own, others;
    MUST(count_pictures(e, 0, &own, err));
    for (int i = 1; i < e->n; i++) {
        MUST(count_pictures(e, i, &others, err));
        if (!others)
            return fs_error_input(err,
                                  "%s: no picture of a view of %s: expected <layer>/<view>.png in it, with layers T_N, "
                                  "T_F, R, I_N or I_F",
                                  e->method[i].dir.text, e->truth);
    }
    if (own || e->n > 1) return 0;
    return fs_error_input(err,
                          "%s: no picture of the truth at %s views has a render in %s: first run `flashsplat "
                          "render %s --cameras %s/cameras.json`, or check --views and --output",
                          e->truth, e->project->set.views, e->method[0].dir.text, e->project->out, e->truth);
}

// Before anything is measured: OUT may be somebody else's.
static int check_place(const FsProject *project, FsError *err)
{
    AtomicFile file = {0};
    int rc = fs_file_begin(&file, fs_file_at("%s/evaluate.json", project->out).text, err);
    fs_file_abort(&file);
    return rc;
}

static int check_truth(const char *truth, FsError *err)
{
    const char *what = "expected a truth: <layer>/<view>.png and cameras.json, as `flashsplat synth -o DIR` makes "
                       "them in DIR/truth";
    if (!fs_file_is_dir(truth)) return fs_error_input(err, "%s: no such folder: %s", truth, what);
    if (fs_file_exists(fs_file_at("%s/cameras.json", truth).text)) return 0;
    bool inside = fs_file_exists(fs_file_at("%s/truth/cameras.json", truth).text);
    return fs_error_input(err, "%s: has no cameras.json: %s%s%s", truth, inside ? "name " : what, inside ? truth : "",
                          inside ? "/truth, which has" : "");
}

int fs_evaluate_run(FsProject *project, const char *truth, FsError *err)
{
    Evaluation e = {.project = project, .truth = truth};
    int rc;
    TRY(check_truth(truth, err));
    TRY(fs_dataset_read(&e.cameras, fs_file_at("%s/cameras.json", truth).text, err));
    TRY(check_renders(project, err));
    if (*project->set.json) TRY(fs_json_file_check(project->set.json, "methods", err));
    TRY(list_methods(&e, err));
    TRY(check_pictures(&e, err));
    TRY(fs_project_begin(project, FS_STAGE_EVALUATE, NULL, 0, err));
    TRY(check_place(project, err));
    e.context.threads = fs_threads_new(project->set.threads);
    TRY(e.context.threads ? 0 : fs_error_memory(err));
    TRY(open_lpips(&e, err));
    for (int l = 0; l < FS_EVALUATE_LAYERS; l++) TRY(evaluate_layer(&e, l, err));
    for (int k = 0; k < FS_EVALUATE_DEPTHS; k++) TRY(evaluate_depth(&e, k, err));
    fs_log_progress(&project->log, "evaluate", FS_EVALUATE_LAYERS * e.n, FS_EVALUATE_LAYERS * e.n, "done");
    TRY(finish(&e, err));
fail:
    for (int i = 0; i < e.n; i++) {
        for (int l = 0; l < FS_EVALUATE_LAYERS; l++) fs_score_free(&e.method[i].layer[l]);
        for (int k = 0; k < FS_EVALUATE_DEPTHS; k++) fs_depth_free(&e.method[i].depth[k]);
        free(e.method[i].name);
    }
    free(e.method);
    fs_dataset_free(&e.cameras);
    fs_lpips_free(e.lpips);
    fs_threads_free(e.context.threads);
    return rc;
}

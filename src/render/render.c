#include "render/render.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "base/threads.h"
#include "engine/as_shot.h"
#include "engine/engine.h"
#include "image/colormap.h"
#include "image/tone.h"
#include "model/preview.h"
#include "model/rendered_from.h"
#include "render/pictures.h"
#include "render/save.h"
#include "render/unseen.h"
#include "render/verdict.h"
#include "render/view_list.h"

#define PROBE_VIEWS 5
#define PROBE_EDGE 200

// Everything that one run of the stage holds.
typedef struct Run {
    FsProject *project;
    Scene scene;
    Dataset photos; // as posed, at working size
    Engine *engine;
    Threads *threads;
    Renders renders;
    bool wanted[RENDER_LAYERS];
    Look look;
    FilePath dir, film_dir;
    AsShot as_shot;
    Unseen unseen;
} Run;

// One walk over views: what to leave behind.
typedef struct Walk {
    const char *what; // for the progress line
    const Dataset *views;
    bool files, films;   // layers as files, films of the views in their order
    PictureSheet *sheet; // NULL: none; else views are those of the photos
    Verdict *verdict;    // likewise
} Walk;

// ---- files of one view, encoded by all threads ----

typedef struct SaveJobs {
    const Run *run;
    const char *view;
    int layer[RENDER_LAYERS];
    FsError error[RENDER_LAYERS];
} SaveJobs;

static void save_job(void *context, int job, int worker)
{
    (void)worker;
    SaveJobs *jobs = context;
    const Run *run = jobs->run;
    int l = jobs->layer[job];
    SaveScale scale = {run->scene.metres_per_unit, fs_scene_white(run->scene.response)};
    fs_save_layer(run->dir.text, (RenderLayer)l, jobs->view, &run->renders.layer[l], scale, run->project->set.linear,
                  &jobs->error[job]);
}

static int save_view(const Run *run, const char *view, FsError *err)
{
    SaveJobs jobs = {.run = run, .view = view};
    int n = 0;
    for (int l = 0; l < RENDER_LAYERS; l++)
        if (run->wanted[l]) jobs.layer[n++] = l;
    fs_threads_for(run->threads, n, save_job, &jobs);
    return fs_error_first(jobs.error, (size_t)n, err);
}

static int save_unseen(const Run *run, const View *view, FsError *err)
{
    bool told = run->unseen.n && (run->wanted[RENDER_R] || run->wanted[RENDER_R_SCENE]);
    Image mask = {0};
    int rc = 0;
    if (told) TRY(fs_unseen_mask(&run->unseen, &view->camera, &run->renders.layer[RENDER_DEPTH_R], &mask, err));
    TRY(fs_save_unseen(run->dir.text, view->name, told ? &mask : NULL, err));
fail:
    fs_image_free(&mask);
    return rc;
}

// ---- what a person should see it with ----

// The depths that hold nearly all of the transmitted scene, from small renders at some of the photos.
static int probe_depth(Run *run, FsError *err)
{
    int chosen[PROBE_VIEWS], n = fs_preview_choose(&run->photos, PROBE_VIEWS, chosen), rc;
    Image all = {0}; // the depth maps below one another
    Renders small = {0};
    TRY(fs_image_new(&all, PROBE_EDGE, PROBE_EDGE * PROBE_VIEWS, 1, err));
    for (int i = 0; i < n; i++) {
        Camera camera = fs_camera_limited(&run->photos.view[chosen[i]].camera, PROBE_EDGE);
        TRY(fs_engine_render(run->engine, &camera, &small, err));
        const Image *depth = &small.layer[RENDER_DEPTH_T];
        memcpy(fs_image_at(&all, 0, i * PROBE_EDGE), depth->px, fs_image_pixels(depth) * sizeof(float));
    }
    if (!fs_colormap_range(&all, 0.01, 0.99, &run->look.nearest, &run->look.farthest)) {
        fs_log_warn(&run->project->log, "render: the transmitted scene is empty at every photo looked at");
        run->look.nearest = run->look.farthest = (float)(run->scene.extent > 0 ? run->scene.extent : 1);
    }
    double farthest = (double)run->look.farthest * run->scene.metres_per_unit; // metres
    if ((run->wanted[RENDER_DEPTH_T] || run->wanted[RENDER_DEPTH_R]) && 1000 * farthest > SAVE_DEPTH_MM)
        fs_log_warn(&run->project->log,
                    "render: depth goes on to %.0f m; in 16-bit PNGs of millimetres what is beyond 65.5 m is 0: is "
                    "--metres-per-unit right?",
                    farthest);
fail:
    fs_image_free(&all);
    fs_engine_renders_free(&small);
    return rc;
}

// From the photos; from a render where the photos are gone.
static int find_exposure(Run *run, FsError *err)
{
    FsError missing = {0};
    if (fs_preview_light(run->project->out, &run->photos, &run->look.light, &missing) == 0) return 0;
    if (missing.code == FS_ERR_MEMORY) return fs_error_memory(err);
    fs_log_warn(&run->project->log, "%s; the exposure of the pictures is taken from a render", missing.message);
    int rc = fs_engine_render(run->engine, &run->photos.view[0].camera, &run->renders, err);
    if (rc == 0) run->look.light.exposure = fs_tone_pleasant_exposure(&run->renders.layer[RENDER_I_F], 1);
    return rc;
}

// ---- the walk ----

// Beside the photo itself: on the contact sheet, and judged.
static int compare_photo(Run *run, const Walk *walk, int i, FsError *err)
{
    const View *view = &run->photos.view[i];
    Image photo = {0}, mask = {0}, composite = {0};
    FsError missing = {0};
    int rc;
    bool shown = walk->sheet && fs_pictures_sheet_wants(walk->sheet, i);
    rc = fs_dataset_load_view(run->project->out, view, &photo, &mask, &missing);
    if (rc == FS_ERR_MEMORY) return fs_error_memory(err); // nothing was loaded
    if (rc < 0 && shown) fs_log_warn(&run->project->log, "%s; the contact sheet lacks that photo", missing.message);
    rc = 0;
    bool usual = fabs(view->flash_gain - 1) < 0.05 || !view->flash || !(view->flash_gain > 0);
    if (walk->verdict) {
        rc = fs_image_copy(&composite, &run->renders.layer[view->flash ? RENDER_I_F : RENDER_I_N], err);
        if (rc == 0) rc = fs_as_shot_apply(&run->as_shot, view, &composite, err);
        if (rc == 0) // a photo of another shutter has another flash than the renders
            fs_verdict_add(walk->verdict, &run->renders, &composite, usual ? &photo : NULL, &mask);
    }
    if (rc == 0 && shown) rc = fs_pictures_sheet_add(walk->sheet, &run->look, &photo, view, &run->renders, err);
    fs_image_free(&photo);
    fs_image_free(&mask);
    fs_image_free(&composite);
    return rc;
}

static int walk_view(Run *run, const Walk *walk, Films *films, int i, FsError *err)
{
    const View *view = &walk->views->view[i];
    if (fs_log_cancelled(&run->project->log))
        return fs_error_set(err, FS_ERR_CANCELLED, "render: stopped after %d of %d %s; what was written stays", i,
                            walk->views->n, walk->what);
    fs_log_progress(&run->project->log, "render", i, walk->views->n, view->name);
    MUST(fs_engine_render(run->engine, &view->camera, &run->renders, err));
    if (walk->files) MUST(save_view(run, view->name, err));
    if (walk->files) MUST(save_unseen(run, view, err));
    if (walk->sheet || walk->verdict) MUST(compare_photo(run, walk, i, err));
    if (films) MUST(fs_pictures_films_add(films, &run->look, &run->renders, err));
    return 0;
}

static int check_film_sizes(const Run *run, const Dataset *views, FsError *err)
{
    for (int i = 1; i < views->n; i++)
        if (views->view[i].camera.width != views->view[0].camera.width ||
            views->view[i].camera.height != views->view[0].camera.height)
            return fs_error_input(err, "%s: its views differ in size, a video needs one size; leave --video",
                                  run->project->set.cameras);
    return 0;
}

// Nothing of the user's is where the layers go.
static int check_files(const Run *run, const Dataset *views, FsError *err)
{
    for (int i = 0; i < views->n * RENDER_LAYERS * 2; i++) {
        int l = i / 2 % RENDER_LAYERS;
        FilePath path = fs_file_at("%s/%s/%s.%s", run->dir.text, fs_render_layers[l].name,
                                   views->view[i / 2 / RENDER_LAYERS].name, i % 2 ? "tif" : "png");
        if (run->wanted[l]) MUST(fs_owned_check(path.text, err));
    }
    MUST(fs_owned_check(fs_rendered_from_path(run->dir.text).text, err));
    for (int i = 0; i < views->n && run->unseen.n; i++)
        MUST(fs_owned_check(fs_save_unseen_path(run->dir.text, views->view[i].name).text, err));
    return 0;
}

// The files go where the photos' renders are, or would be.
static bool is_photos_place(const Run *run)
{
    FilePath own = fs_file_at("%s/renders", run->project->out);
    struct stat there, dir;
    if (strcmp(own.text, run->dir.text) == 0) return true;
    return stat(own.text, &there) == 0 && stat(run->dir.text, &dir) == 0 && there.st_dev == dir.st_dev &&
           there.st_ino == dir.st_ino;
}

// The stage as it stands made films, where those of a path go, too.
static bool stage_has_films(const Run *run)
{
    json_t *mark = fs_project_mark(run->project->out, "render");
    bool films = json_is_true(json_object_get(json_object_get(mark, "settings"), "video"));
    json_decref(mark);
    return films;
}

// The files, or the films, go where those of the stage are.
static bool is_own_place(const Run *run)
{
    const Settings *set = &run->project->set;
    return (!*set->output && (set->video || strcmp(set->path, "spiral") == 0)) || is_photos_place(run);
}

// Layers that an earlier training left would be taken for this one's. In the project's own folders all are looked
// after; the films there are of one of them.
static void drop_outdated(const Run *run)
{
    const char *out = run->project->out, *elsewhere = run->project->set.output;
    FilePath scene = fs_file_at("%s/clouds/model.json", out);
    FilePath folder[] = {*elsewhere ? run->dir : fs_file_at("%s/renders", out), fs_file_at("%s/path", out)};
    RenderedFrom from[2] = {fs_rendered_from_ask(run->project, folder[0].text), RENDERED_FROM_UNKNOWN};
    if (!*elsewhere) from[1] = fs_rendered_from_ask(run->project, folder[1].text);
    bool films_stay = from[0] == RENDERED_FROM_THESE || from[1] == RENDERED_FROM_THESE;
    int n = 0;
    for (int i = 0; i < (*elsewhere ? 1 : 2); i++) {
        if (from[i] == RENDERED_FROM_THESE) continue;
        n += fs_save_drop_older(folder[i].text, films_stay ? NULL : run->film_dir.text,
                                from[i] == RENDERED_FROM_OTHERS ? NULL : scene.text);
    }
    if (n)
        fs_log_info(&run->project->log, "render: removed %d files of an earlier training from %s", n,
                    *elsewhere ? elsewhere : out);
}

// The folder has depths in another unit than it will tell.
static bool has_other_units(const Run *run)
{
    if (fs_rendered_from_ask(run->project, run->dir.text) != RENDERED_FROM_THESE) return false;
    const double was = fs_rendered_from_scale(run->dir.text), is = run->scene.metres_per_unit;
    return !(fabs(was - is) <= 1e-9 * is);
}

static void drop_other_units(const Run *run)
{
    if (!has_other_units(run)) return;
    const RenderLayer depths[] = {RENDER_DEPTH_T, RENDER_DEPTH_R};
    for (int i = 0; i < 2; i++)
        fs_owned_remove(fs_file_at("%s/%s", run->dir.text, fs_render_layers[depths[i]].name).text);
}

// The stage's own pictures get others under the same names, or go. Views of other names go beside them.
static bool replaces(const Run *run, const Walk *walk)
{
    if (walk->films && is_own_place(run) && stage_has_films(run)) return true;
    if (!walk->files || !is_photos_place(run)) return false;
    for (int i = 0; i < walk->views->n; i++)
        if (fs_dataset_find(&run->photos, walk->views->view[i].name) >= 0) return true;
    return has_other_units(run);
}

// Makes the folder that the layers go to one of this scene.
static int open_dir(const Run *run, const Walk *walk, FsError *err)
{
    if (*run->project->set.output) MUST(fs_owned_open(run->dir.text, "renders", err));
    if (replaces(run, walk))
        fs_project_unmark(run->project, FS_STAGE_RENDER);
    else if (is_photos_place(run))
        fs_project_unmark(run->project, FS_STAGE_EVALUATE); // may have been of the views that come now
    drop_outdated(run);
    drop_other_units(run);
    MUST(fs_file_mkdirs(run->dir.text, err));
    return fs_rendered_from_write(run->project, run->dir.text, run->scene.metres_per_unit, err);
}

static int walk_views(Run *run, const Walk *walk, FsError *err)
{
    Films *films = NULL;
    int rc = 0;
    if (walk->files) TRY(check_files(run, walk->views, err));
    TRY(open_dir(run, walk, err));
    if (walk->films) {
        const Camera *first = &walk->views->view[0].camera;
        TRY(check_film_sizes(run, walk->views, err));
        TRY(fs_pictures_films_begin(&films, run->film_dir.text, first->width, first->height, &run->project->log, err));
    }
    for (int l = 0; l < RENDER_LAYERS && walk->files; l++)
        if (run->wanted[l]) TRY(fs_save_prepare(run->dir.text, (RenderLayer)l, err));
    for (int i = 0; i < walk->views->n; i++) TRY(walk_view(run, walk, films, i, err));
    fs_log_progress(&run->project->log, "render", walk->views->n, walk->views->n, walk->what);
    if (films) {
        Films *done = films;
        films = NULL;
        TRY(fs_pictures_films_finish(done, err));
        fs_log_info(&run->project->log, "render: films of %d %s in %s", walk->views->n, walk->what, run->film_dir.text);
    }
    if (walk->files)
        fs_log_info(&run->project->log, "render: %d %s, each layer in %s", walk->views->n, walk->what, run->dir.text);
    if (walk->files && run->unseen.n)
        fs_log_info(&run->project->log,
                    "render: %s/unseen is white where R is a guess: hardly a photo shows it clear of the photographer",
                    run->dir.text);
fail:
    fs_pictures_films_abort(films);
    return rc;
}

// ---- the jobs: photos, a model's views, a path ----

static int render_photos(Run *run, FsError *err)
{
    Dataset views = {0};
    PictureSheet *sheet = NULL;
    Verdict verdict = {0};
    const char *elsewhere = run->project->set.output;
    FilePath sheet_path = fs_file_at("%s/sheet.png", *elsewhere ? elsewhere : run->project->out);
    int rc;
    TRY(fs_owned_check(sheet_path.text, err));
    TRY(fs_view_list_of_photos(run->project, &run->photos, &views, err));
    TRY(fs_pictures_sheet_begin(&sheet, &run->photos, err));
    TRY(walk_views(run, &(Walk){.what = "photos", .views = &views, .files = true, .sheet = sheet, .verdict = &verdict},
                   err));
    if (run->scene.separation != SEPARATION_NONE) fs_verdict_tell(&verdict, &run->project->log);
    TRY(fs_pictures_sheet_write(sheet, sheet_path.text, err));
    fs_log_info(&run->project->log, "render: contact sheet %s", sheet_path.text);
fail:
    fs_pictures_sheet_free(sheet);
    fs_dataset_free(&views);
    return rc;
}

// The views of the setting "cameras", or of a spiral.
static int render_path(Run *run, bool spiral, bool files, FsError *err)
{
    Dataset views = {0};
    Walk walk = {"views", &views, files, .films = run->project->set.video};
    int rc;
    if (spiral) {
        walk.what = "frames of the spiral path";
        walk.films = true;
        TRY(fs_view_list_of_spiral(run->project, &run->photos, run->look.nearest, run->look.farthest, &views, err));
    } else { // in a run, which has no other place, they are the only renders
        bool own_place = is_photos_place(run) && !run->project->planned;
        TRY(fs_view_list_of_model(run->project, &run->photos, own_place, &views, err));
    }
    TRY(walk_views(run, &walk, err));
fail:
    fs_dataset_free(&views);
    return rc;
}

static int open_run(Run *run, FsError *err)
{
    const FsProject *project = run->project;
    const Settings *set = &project->set;
    bool spiral = strcmp(set->path, "spiral") == 0;
    FilePath views = fs_file_at("%s/views.json", project->out);
    run->dir =
        *set->output ? fs_file_at("%s", set->output) : fs_file_at("%s/%s", project->out, spiral ? "path" : "renders");
    run->film_dir = fs_file_at("%s/video", *set->output ? set->output : project->out);
    bool all = fs_settings_has_word(set->layers, "all");
    for (int l = 0; l < RENDER_LAYERS; l++)
        run->wanted[l] = all || fs_settings_has_word(set->layers, fs_render_layers[l].name);
    MUST(fs_scene_read(&run->scene, fs_file_at("%s/clouds", project->out).text, err));
    if (set->metres_per_unit > 0) run->scene.metres_per_unit = set->metres_per_unit;
    MUST(fs_dataset_read(&run->photos, views.text, err));
    if (run->photos.n == 0)
        return fs_error_input(err, "%s: no posed photos in it; run flashsplat poses first", views.text);
    MUST(fs_engine_new(&run->engine, set->device, set->cpu, set->threads, err));
    MUST(fs_engine_scene_up(run->engine, &run->scene, err));
    MUST(fs_as_shot_open(&run->as_shot, &run->scene, project->out, err));
    MUST(fs_unseen_open(&run->unseen, project->out, &run->photos, err));
    run->threads = fs_threads_new(set->threads);
    return run->threads ? 0 : fs_error_memory(err);
}

int fs_render_run(FsProject *project, FsError *err)
{
    const Settings *set = &project->set;
    bool spiral = strcmp(set->path, "spiral") == 0, model = *set->cameras, usual = !spiral && !model && !*set->output;
    Run run = {.project = project};
    int rc;
    if (usual && fs_project_done(project, FS_STAGE_RENDER)) return 0;
    if (*set->output) MUST(fs_project_check_output(project, set->output, err));
    FsError earlier = {0}; // elsewhere views may be had of the clouds before, while others are trained
    if (!usual && fs_project_check_earlier(project, FS_STAGE_RENDER, &earlier) < 0)
        fs_log_warn(&project->log, "these views are of the clouds of an earlier training: %s", earlier.message);
    TRY(open_run(&run, err));
    if (usual) TRY(fs_project_begin(project, FS_STAGE_RENDER, NULL, 0, err));
    if (is_own_place(&run)) TRY(fs_project_lock(project, err));
    if (!*set->output) TRY(fs_owned_open(project->out, "project", err));
    TRY(probe_depth(&run, err));
    TRY(find_exposure(&run, err));
    TRY(model || spiral ? render_path(&run, spiral, true, err) : render_photos(&run, err));
    if (set->video && !spiral && !model) TRY(render_path(&run, true, false, err));
    if (usual) TRY(fs_project_mark_done(project, FS_STAGE_RENDER, err));
fail:
    fs_scene_free(&run.scene);
    fs_dataset_free(&run.photos);
    fs_engine_renders_free(&run.renders);
    fs_as_shot_close(&run.as_shot);
    fs_unseen_close(&run.unseen);
    fs_engine_free(run.engine);
    fs_threads_free(run.threads);
    return rc;
}

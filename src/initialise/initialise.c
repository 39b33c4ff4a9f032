#include "initialise/initialise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/threads.h"
#include "initialise/constants.h"
#include "initialise/depth_cue.h"
#include "initialise/given_points.h"
#include "initialise/intensity_cue.h"
#include "initialise/lamp_depth.h"
#include "initialise/start.h"
#include "model/colmap_model.h"
#include "model/photos.h"
#include "model/points_ply.h"

// Photos that found each point, by their lighting.
static void count_sightings(const ColmapModel *model, const ColmapPoint *point, const signed char *lighting,
                            int sightings[2])
{
    for (int k = 0; k < point->n; k++) {
        int image = fs_colmap_model_image(model, model->track[point->first + k].image_id);
        if (image >= 0 && lighting[image] >= 0) sightings[(int)lighting[image]]++;
    }
}

// Of the model's images: 1 with the flash, 0 without; -1: not one of those that training may see.
static signed char *lightings(const ColmapModel *model, const Dataset *dataset)
{
    signed char *lighting = malloc((size_t)model->n_images + 1);
    for (int i = 0; lighting && i < model->n_images; i++) {
        int view = fs_dataset_find(dataset, model->image[i].name);
        lighting[i] = view >= 0 && fs_dataset_trains(&dataset->view[view]) ? dataset->view[view].flash : -1;
    }
    return lighting;
}

// seen_by: their sightings are counted; NULL: nobody asks.
static int read_points(const FsProject *project, const Dataset *seen_by, SparsePoints *points, FsError *err)
{
    ColmapModel model = {0};
    signed char *lighting = NULL;
    FilePath dir = fs_file_at("%s/sparse", project->out);
    char *place = fs_colmap_model_find(dir.text);
    bool there = place;
    free(place);
    if (!there) return fs_project_missing(project->out, FS_STAGE_POSES, "sparse", err);
    int rc = fs_colmap_model_read(dir.text, &model, err);
    if (rc < 0) return rc;
    if (seen_by && !(lighting = lightings(&model, seen_by))) TRY(fs_error_memory(err));
    TRY(fs_points_new(points, model.n_points, err));
    points->n = 0;
    for (int i = 0; i < model.n_points; i++) {
        const double *p = model.point[i].xyz;
        if (!(fabs(p[0]) < 1e15 && fabs(p[1]) < 1e15 && fabs(p[2]) < 1e15)) continue;
        for (int k = 0; k < 3; k++) points->xyz[3 * (size_t)points->n + (size_t)k] = (float)p[k];
        if (lighting) count_sightings(&model, &model.point[i], lighting, points->sightings[points->n]);
        points->n++;
    }
    if (points->n < FS_COLMAP_FEWEST_POINTS)
        TRY(fs_error_set(err, FS_ERR_INPUT,
                         "%s: %d points, at least %d are needed; run the poses stage again (--force), "
                         "or photograph a scene with more texture",
                         dir.text, points->n, FS_COLMAP_FEWEST_POINTS));
fail:
    fs_colmap_model_free(&model);
    free(lighting);
    return rc;
}

// One kind's points, coloured from the dullest (blue) to the most brightened (red) contrast.
static int write_kind(const char *path, const SparsePoints *points, PointKind kind, FsError *err)
{
    int rc = 0, m = 0;
    size_t size = (size_t)points->n + 1;
    float *xyz = malloc(sizeof(float) * 3 * size), *value = malloc(sizeof(float) * size);
    unsigned char *rgb = malloc(3 * size);
    if (!xyz || !value || !rgb) TRY(fs_error_memory(err));
    for (int i = 0; i < points->n; i++) {
        if (points->kind[i] != kind) continue;
        memcpy(xyz + 3 * (size_t)m, points->xyz + 3 * (size_t)i, sizeof(float) * 3);
        value[m] = expf(points->cue[i].log_slope);
        float t = fminf(fmaxf((value[m] - 0.8f) / 1.4f, 0), 1);
        rgb[3 * m] = (unsigned char)(255 * t);
        rgb[3 * m + 1] = (unsigned char)(255 * (1 - fabsf(2 * t - 1)));
        rgb[3 * m + 2] = (unsigned char)(255 * (1 - t));
        m++;
    }
    TRY(fs_cloud_points_write(path, m, xyz, rgb, value, err));
fail:
    free(xyz);
    free(value);
    free(rgb);
    return rc;
}

static int write_dense(const char *path, const PointList *points, unsigned char shade, FsError *err)
{
    unsigned char *rgb = malloc(3 * (size_t)points->n + 1);
    if (!rgb) return fs_error_memory(err);
    memset(rgb, shade, 3 * (size_t)points->n);
    int rc = fs_cloud_points_write(path, points->n, points->xyz, rgb, NULL, err);
    free(rgb);
    return rc;
}

// The lamps behind the pane, for training.
static int write_lamps(const char *path, const Start *start, FsError *err)
{
    PointList lamps;
    int rc, judged;
    TRY(fs_lamp_depth_find(start->views, start->dense, start->threads, &lamps, &judged, err));
    if (lamps.n)
        fs_log_info(start->log, "initialise: %.0f %% of what is clipped without the flash is behind the pane",
                    100.0 * lamps.n / judged);
    TRY(write_dense(path, &lamps, 255, err));
fail:
    fs_points_list_free(&lamps);
    return rc;
}

static int write_start(const FsProject *project, const Start *start, const Scene *scene, FsError *err)
{
    int rc = 0;
    static const char *const kind[2] = {"transmitted", "reflected"};
    FilePath dir = fs_file_at("%s/start", project->out);
    TRY(fs_file_mkdirs(dir.text, err));
    TRY(write_lamps(fs_file_at("%s/lamps.ply", dir.text).text, start, err));
    for (int k = 0; k < 2; k++) {
        FilePath sparse = fs_file_at("%s/%s.ply", dir.text, kind[k]);
        FilePath surface = fs_file_at("%s/%s_surface.ply", dir.text, kind[k]);
        TRY(write_kind(sparse.text, start->points, k ? POINT_REFLECTED : POINT_TRANSMITTED, err));
        TRY(write_dense(surface.text, start->dense[k], k ? 128 : 224, err));
    }
    TRY(fs_scene_write(scene, dir.text, err));
fail:
    return rc;
}

// given: the rest of a cloud of --points.
static int load(const FsProject *project, SmallViews *views, SparsePoints *points, PointList *given, FsError *err)
{
    int rc = 0;
    Dataset dataset = {0};
    FilePath path = fs_file_at("%s/views.json", project->out);
    TRY(fs_dataset_read(&dataset, path.text, err));
    int blurred = fs_dataset_leave_blurred(&dataset, project->set.least_sharpness);
    if (blurred)
        fs_log_info(&project->log,
                    "initialise: %d blurred photos are left out, here and in training (--least-sharpness)", blurred);
    fs_dataset_lift(&dataset, fs_settings_brightness(&project->set));
    TRY(fs_small_views_load(views, project->out, &dataset, INPUT_LONG_EDGE, err));
    int fewest[2];
    fs_photos_fewest(&project->set, false, fewest);
    if (views->n_flash < fewest[1] || views->n - views->n_flash < fewest[0])
        TRY(fs_error_set(err, FS_ERR_INPUT,
                         "%s: %d photos with flash and %d without to begin with, both kinds are needed: pose more of "
                         "them, or hold out fewer (poses --test-every)",
                         path.text, views->n_flash, views->n - views->n_flash));
    if (*project->set.points)
        TRY(fs_given_points_read(project->set.points, views, points, given, err));
    else
        TRY(read_points(project, NULL, points, err));
fail:
    fs_dataset_free(&dataset);
    return rc;
}

// Without the flash's cues nothing is parted.
static bool parts(const Settings *set)
{
    return strcmp(set->separation, "full") == 0 || strcmp(set->separation, "linear") == 0;
}

// The clouds of either lighting, each point sighted in that.
static int read_lightings(const Settings *set, SparsePoints *points, FsError *err)
{
    const char *const path[2] = {set->noflash_points, set->flash_points};
    float *xyz[2] = {NULL, NULL};
    int rc = 0, n[2] = {0, 0};
    for (int flash = 0; flash < 2; flash++) {
        TRY(fs_points_ply_read(path[flash], &xyz[flash], &n[flash], err));
        if (n[flash] < INPUT_FEWEST)
            TRY(fs_error_input(err, "%s: %d points, expected a dense cloud of the photos %s flash", path[flash],
                               n[flash], flash ? "with" : "without"));
    }
    TRY(fs_points_new(points, n[0] + n[1], err));
    for (int flash = 0, at = 0; flash < 2; at += n[flash++]) {
        memcpy(points->xyz + 3 * (size_t)at, xyz[flash], sizeof(float) * 3 * (size_t)n[flash]);
        for (int i = 0; i < n[flash]; i++) points->sightings[at + i][flash] = DEPTH_CUE_SIGHTINGS;
    }
fail:
    free(xyz[0]);
    free(xyz[1]);
    return rc;
}

// As the paper or its program parts the points, for comparisons: by their light, or by one depth, which the points of
// the poses tell.
static int part_otherwise(const FsProject *project, const SmallViews *views, SparsePoints *points, FsError *err)
{
    int rc = 0, mirrored;
    double at;
    Dataset dataset = {0};
    SparsePoints found = {0};
    bool by_depth = strcmp(project->set.flash_cue, "depth") == 0;
    if (!by_depth && strcmp(project->set.flash_cue, "intensity") != 0) return 0;
    if (by_depth) {
        TRY(fs_dataset_read(&dataset, fs_file_at("%s/views.json", project->out).text, err));
        TRY(*project->set.flash_points ? read_lightings(&project->set, &found, err)
                                       : read_points(project, &dataset, &found, err));
        TRY(fs_depth_cue_find(views, &found, &at, err));
        mirrored = fs_depth_cue_part(views, at, points);
    } else {
        TRY(fs_intensity_cue_part(views, points, &at, &mirrored, err));
    }
    fs_log_info(&project->log, "initialise: parted at a %s of %.3g: %d points transmitted, %d reflected",
                by_depth ? "depth" : "growth of the light", at, points->n - mirrored, mirrored);
fail:
    fs_points_free(&found);
    fs_dataset_free(&dataset);
    return rc;
}

bool fs_initialise_looks(const Settings *set)
{
    bool field = strcmp(set->model, "field") == 0, contrast = strcmp(set->flash_cue, "contrast") == 0;
    return !field && !*set->points && contrast && parts(set); // it goes by the contrast's growth
}

// given: the rest of a cloud of --points, or nothing.
static int find_surfaces(const FsProject *project, const Start *start, const PointList *given, PointList dense[2],
                         FsError *err)
{
    if (given->xyz)
        MUST(fs_given_points_split(start->points, given, start->threads, dense, err));
    else if (fs_initialise_looks(&project->set))
        MUST(fs_residual_stereo_find(start, dense, err));
    fs_log_info(&project->log, "initialise: %d dense points transmitted, %d reflected", dense[0].n, dense[1].n);
    return 0;
}

int fs_initialise_check(const Settings *set, FsError *err)
{
    if (strcmp(set->model, "field") == 0 &&
        (strcmp(set->separation, "linear") == 0 || strcmp(set->geometry, "shared") != 0))
        return fs_error_set(err, FS_ERR_USAGE,
                            "--model field goes with --separation none, flashless or full and --geometry shared");
    if (!*set->flash_points != !*set->noflash_points)
        return fs_error_set(err, FS_ERR_USAGE, "--flash-points and --noflash-points: give both, or none");
    if (*set->flash_points && strcmp(set->flash_cue, "depth") != 0)
        return fs_error_set(err, FS_ERR_USAGE, "--flash-points and --noflash-points go with --flash-cue depth");
    return 0;
}

int fs_initialise_run(FsProject *project, FsError *err)
{
    MUST(fs_initialise_check(&project->set, err));
    if (fs_project_done(project, FS_STAGE_INITIALISE)) return 0;
    int rc = 0;
    const Log *log = &project->log;
    SmallViews views = {0};
    SparsePoints points = {0};
    Scene scene = {0};
    FlashLight light;
    PointList dense[2] = {0}, given = {0};
    DepthOdds odds;
    Threads *threads = fs_threads_new(project->set.threads);
    const Start start = {.views = &views,
                         .points = &points,
                         .dense = {&dense[0], &dense[1]},
                         .odds = &odds,
                         .light = &light,
                         .seed = (uint64_t)project->set.seed,
                         .threads = threads,
                         .log = log};
    if (!threads) return fs_error_memory(err);
    fs_log_progress(log, "initialise", 0, 4, "reading the photos");
    TRY(load(project, &views, &points, &given, err));
    TRY(fs_project_begin(project, FS_STAGE_INITIALISE, NULL, 0, err)); // what was there goes
    bool field = strcmp(project->set.model, "field") == 0;
    if (!field || strcmp(project->set.separation, "full") == 0) {
        fs_log_progress(log, "initialise", 1, 4, "telling the two scenes apart");
        fs_cue_measure(&views, points.xyz, points.n, points.cue, threads);
        TRY(fs_classify_points(&views, &points, &odds, threads, err));
        TRY(fs_light_fit(&views, &points, &light, err));
        if (parts(&project->set)) fs_advise(&views, &points, &light, log);
    }
    if (field) {
        TRY(fs_first_field_make(&start, &project->set, &scene, err));
        TRY(fs_scene_write(&scene, fs_file_at("%s/start", project->out).text, err));
        TRY(fs_project_mark_done(project, FS_STAGE_INITIALISE, err));
        fs_log_progress(log, "initialise", 4, 4, "done");
        goto fail;
    }
    fs_log_progress(log, "initialise", 2, 4, "finding their surfaces");
    if (parts(&project->set)) TRY(part_otherwise(project, &views, &points, err));
    TRY(find_surfaces(project, &start, &given, dense, err));
    fs_log_progress(log, "initialise", 3, 4, "making the first clouds");
    TRY(fs_first_scene_make(&start, &project->set, &scene, err));
    fs_scene_lift(&scene, 1 / views.lift);
    TRY(write_start(project, &start, &scene, err));
    TRY(fs_project_mark_done(project, FS_STAGE_INITIALISE, err));
    fs_log_progress(log, "initialise", 4, 4, "done");
fail:
    fs_scene_free(&scene);
    fs_points_list_free(&given);
    fs_points_list_free(&dense[0]);
    fs_points_list_free(&dense[1]);
    fs_points_free(&points);
    fs_small_views_free(&views);
    fs_threads_free(threads);
    return rc;
}

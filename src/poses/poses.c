#include "poses/poses.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/linalg.h"
#include "base/order.h"
#include "base/owned.h"
#include "model/dataset.h"
#include "model/photos.h"
#include "poses/match.h"
#include "poses/missing.h"
#include "poses/sparse.h"

enum { MATCHED_FEATURES = 3000, FEWEST_MATCHED_FEATURES = 1000 };
enum { MOST_FOR_ALL_PAIRS = 100, CHOSEN_FEATURES = 1500 }; // of more photos, only pairs that are alike are matched
// Steps of a float between places that the cameras' extent must have (of 0.8 a capture is lost), and should have (380
// cost half a decibel of the composites).
#define COARSE_STEPS 100.0
#define FINE_STEPS 2000.0
#define ONE_PLACE 1e-9 // of their distance from the origin: what is left of places that are the same, by rounding

static int check_posed(const FsProject *project, const Capture *capture, const Sparse *sparse, FsError *err)
{
    const char *known = project->set.poses;
    int n = 0, all[2] = {0, 0}, group[2] = {0, 0};
    char missing[400];
    for (int i = 0; i < capture->n; i++) {
        all[capture->photo[i].flash]++;
        group[capture->photo[i].flash] += sparse->pose[i].known;
        n += sparse->pose[i].known;
    }
    fs_missing_names(sparse, capture, missing, sizeof missing);
    if (3 * n < 2 * capture->n && *known)
        return fs_error_input(
            err,
            "%s: has poses of %d of the %d photos only (names are compared without folder and extension); missing: %s",
            known, n, capture->n, missing);
    if (3 * n < 2 * capture->n)
        return fs_error_input(err,
                              "only %d of %d photos could be posed; failed: %s. Take photos that overlap more (step 5 "
                              "to 10 cm), sharp and with texture, or give known poses with --poses",
                              n, capture->n, missing);
    int fewest[2];
    fs_photos_fewest(&project->set, !*known, fewest);
    for (int few = 0; few < 2; few++) {
        const char *what = few ? "flash" : "no-flash";
        if (group[few] < fewest[few])
            return fs_error_input(err,
                                  "only %d of %d %s photos have a pose, at least %d are needed; without: %s. Take more "
                                  "%s photos from the same places as the others, or leave bad ones out",
                                  group[few], all[few], what, fewest[few], *missing ? missing : "none", what);
        if (fewest[few] && group[few] < FS_PHOTOS_FOR_COLMAP)
            fs_log_warn(&project->log, "only %d %s photos: at least %d are advised", group[few], what,
                        FS_PHOTOS_FOR_COLMAP);
    }
    if (n < capture->n)
        fs_log_warn(&project->log, "poses: %d of %d photos have a pose%s%s; left out: %s", n, capture->n,
                    *known ? " in " : "", known, missing);
    return 0;
}

static int match_and_verify(Colmap *colmap, const FsProject *project, const Capture *capture, const Features *features,
                            FsError *err)
{
    int rc = 0;
    size_t pairs = fs_match_pairs(capture->n);
    MatchList *list = calloc(pairs + 1, sizeof *list);
    bool *chosen = capture->n > MOST_FOR_ALL_PAIRS ? malloc(pairs * sizeof *chosen) : NULL;
    Threads *threads = fs_threads_new(project->set.threads);
    if (!list || !threads || (!chosen && capture->n > MOST_FOR_ALL_PAIRS)) TRY(fs_error_memory(err));
    int most = capture->n > 40 ? 40 * MATCHED_FEATURES / capture->n : MATCHED_FEATURES; // pairs grow with the square
    if (most < FEWEST_MATCHED_FEATURES) most = FEWEST_MATCHED_FEATURES;
    if (chosen) {
        most = CHOSEN_FEATURES;
        TRY(fs_match_choose(features, capture->n, threads, &project->log, chosen, err));
        size_t n = 0;
        for (size_t i = 0; i < pairs; i++) n += chosen[i];
        fs_log_info(&project->log, "poses: %d photos: the %zu most alike of %zu pairs are matched", capture->n, n,
                    pairs);
    }
    TRY(fs_match_all(features, capture->n, (MatchOptions){most, 0.8f, chosen}, threads, &project->log, list, err));
    TRY(fs_colmap_verify(colmap, list, err));
fail:
    fs_match_free(list, capture->n);
    free(chosen);
    fs_threads_free(threads);
    return rc;
}

// Poses by COLMAP; `features` are what it found.
static int find_poses(Colmap *colmap, const FsProject *project, const Capture *capture, const Features *features,
                      Sparse *sparse, FsError *err)
{
    int rc = 0;
    ColmapModel model = {0}, flash = {0};
    TRY(match_and_verify(colmap, project, capture, features, err));
    if (strcmp(project->set.align, "separate") == 0) {
        TRY(fs_colmap_map(colmap, 0, &model, err));
        TRY(fs_colmap_map(colmap, 1, &flash, err));
        TRY(fs_align_groups(capture, features, &model, &flash, &project->log, err));
        TRY(fs_sparse_from_colmap(sparse, capture, &flash, err));
    } else {
        TRY(fs_colmap_map(colmap, -1, &model, err));
    }
    TRY(fs_sparse_from_colmap(sparse, capture, &model, err));
fail:
    fs_colmap_model_free(&model);
    fs_colmap_model_free(&flash);
    return rc;
}

static int check_features(const Capture *capture, const Features *features, FsError *err)
{
    int n = 0;
    for (int i = 0; i < capture->n; i++) n += features[i].n > 0;
    if (n > 0) return 0;
    return fs_error_input(err,
                          "%s: COLMAP found nothing to go by in any of the %d pictures: black, blurred or without "
                          "texture? Take photos that are sharp and well exposed",
                          capture->pictures, capture->n);
}

static bool at_one_place(double extent, const double centre[3])
{
    return extent <= ONE_PLACE * sqrt(v3_dot(centre, centre)) || extent < 1e-12;
}

static int say_one_place(const FsProject *project, int n, FsError *err)
{
    return fs_error_input(err,
                          "%s: the cameras of all %d photos are at one place: nothing tells how far away things "
                          "are; take photos from places 5 to 10 cm apart, or give their true poses",
                          *project->set.poses ? project->set.poses : project->out, n);
}

// Too few points, and why.
static int explain_points(const FsProject *project, const Capture *capture, const Sparse *sparse,
                          const Features *features, FsError *err)
{
    int n = 0;
    double centre[3] = {0}, extent = 0;
    double *count = malloc(((size_t)capture->n + 1) * sizeof *count);
    Camera *camera = malloc(((size_t)capture->n + 1) * sizeof *camera);
    if (count && camera) {
        for (int i = 0; i < capture->n; i++)
            if (sparse->pose[i].known) camera[n] = sparse->pose[i].camera, count[n++] = features[i].n;
        extent = fs_camera_extent(camera, sizeof *camera, n, centre);
    }
    double usual = count ? fs_order_median(count, (size_t)n) : 0;
    bool out_of_memory = !count || !camera;
    free(count);
    free(camera);
    if (out_of_memory) return fs_error_memory(err);
    const char *from = *project->set.poses ? project->set.poses : project->out;
    if (at_one_place(extent, centre)) return say_one_place(project, n, err);
    if (usual < FS_COLMAP_FEW_FEATURES)
        return fs_error_input(err,
                              "%s: only %d points, at least %d are needed: half of the photos show %d features or "
                              "fewer; take photos that are sharp and well exposed, of a scene with more texture",
                              project->out, sparse->n_points, FS_COLMAP_FEWEST_POINTS, (int)usual);
    return fs_error_input(err, "%s: only %d points, at least %d are needed, though photos show %d features: %s", from,
                          sparse->n_points, FS_COLMAP_FEWEST_POINTS, (int)usual,
                          *project->set.poses ? "the poses do not fit the photos; check that they are of these photos, "
                                                "or let COLMAP find them (without --poses; of a scene folder, "
                                                "name the folder of its photos)"
                                              : "take photos that overlap more, step 5 to 10 cm");
}

// None are an error, for the next run to try again. With some the scenes may still start from a cloud of the user's.
static int check_points(const FsProject *project, const Capture *capture, const Sparse *sparse,
                        const Features *features, FsError *err)
{
    const Settings *set = &project->set;
    bool own = *set->points || (*set->noflash_points && *set->flash_points);
    FsError why = {0};
    int rc = explain_points(project, capture, sparse, features, &why);
    if (rc == FS_ERR_INPUT && (sparse->n_points > 0 || own)) {
        if (!own) fs_log_warn(&project->log, "%s", why.message);
        return 0;
    }
    if (err) *err = why;
    return rc;
}

// Scenes are held in 32-bit floats: far from the origin, as places in survey coordinates lie, these are too coarse.
static int check_origin(const FsProject *project, const Capture *capture, const Sparse *sparse, FsError *err)
{
    int n = 0;
    double centre[3] = {0};
    Camera *camera = malloc(((size_t)capture->n + 1) * sizeof *camera);
    if (!camera) return fs_error_memory(err);
    for (int i = 0; i < capture->n; i++)
        if (sparse->pose[i].known) camera[n++] = sparse->pose[i].camera;
    double extent = fs_camera_extent(camera, sizeof *camera, n, centre);
    free(camera);
    double away = sqrt(v3_dot(centre, centre)), step = away * (double)FLT_EPSILON;
    if (at_one_place(extent, centre)) return say_one_place(project, n, err);
    if (extent > FINE_STEPS * step) return 0;
    if (extent < COARSE_STEPS * step)
        return fs_error_input(
            err,
            "%s: the cameras are %.3g from the origin and %.3g from each other's middle: places there "
            "can only be told to %.2g; subtract an offset from the poses (and points), as from survey "
            "coordinates",
            project->set.poses, away, extent, step);
    fs_log_warn(&project->log,
                "%s: the cameras are %.3g from the origin, where places are told to %.2g only: pictures will be less "
                "sharp; better subtract an offset from the poses (and points)",
                project->set.poses, away, step);
    return 0;
}

// How the pictures that the model is of differ from the photos.
static void log_frames(const FsProject *project, const Capture *capture, const Sparse *sparse)
{
    int turned = 0, cropped = 0;
    for (int i = 0; i < capture->n; i++) {
        const ModelFrame *frame = &sparse->pose[i].frame;
        turned += sparse->pose[i].known && frame->quarters > 0;
        cropped += sparse->pose[i].known && frame->margin[0] + frame->margin[1] > 0;
    }
    if (turned)
        fs_log_info(&project->log, "poses: %d photos are not upright in %s: their poses are turned as EXIF says",
                    turned, project->set.poses);
    if (cropped)
        fs_log_info(&project->log, "poses: %s has %d photos a little smaller: taken for the middle of what is here",
                    project->set.poses, cropped);
}

// Fills the poses and points.
static int reconstruct(const FsProject *project, const Capture *capture, Sparse *sparse, FsError *err)
{
    int rc = 0;
    Colmap colmap = {0};
    Features *features = calloc((size_t)capture->n + 1, sizeof *features);
    if (!features) return fs_error_memory(err);
    if (*project->set.poses) {
        TRY(fs_sparse_from_file(sparse, capture, project->set.poses, err));
        log_frames(project, capture, sparse);
        TRY(check_posed(project, capture, sparse, err));
        TRY(check_origin(project, capture, sparse, err));
        if (sparse->n_points > 0) goto fail; // the model has points: nothing to look for
    }
    TRY(fs_colmap_open(&colmap, project, capture, err));
    TRY(fs_colmap_extract(&colmap, features, err));
    TRY(check_features(capture, features, err));
    if (!*project->set.poses) {
        TRY(find_poses(&colmap, project, capture, features, sparse, err));
        TRY(fs_missing_explain(&colmap, features, sparse, err));
        TRY(check_posed(project, capture, sparse, err));
    }
    TRY(fs_sparse_triangulate(sparse, project, capture, features, err));
    if (!*project->set.poses && strcmp(project->set.align, "joint") == 0) {
        TRY(fs_adjust_poses(&colmap, sparse, err));
        TRY(fs_sparse_triangulate(sparse, project, capture, features, err));
    }
    if (sparse->n_points < FS_COLMAP_FEWEST_POINTS) TRY(check_points(project, capture, sparse, features, err));
    TRY(fs_sparse_colour(sparse, capture, err));
fail:
    for (int i = 0; i < capture->n; i++) fs_database_features_free(&features[i]);
    free(features);
    fs_colmap_close(&colmap);
    return rc;
}

static void log_points(const FsProject *project, const Capture *capture, const Sparse *sparse)
{
    int only[2] = {0, 0};
    double error = 0;
    for (int k = 0; k < sparse->n_points; k++) {
        int seen[2] = {0, 0};
        for (int l = 0; l < sparse->point[k].n; l++)
            seen[capture->photo[sparse->sighting[sparse->point[k].first + l].photo].flash]++;
        only[0] += !seen[1];
        only[1] += !seen[0];
        error += sparse->point[k].error;
    }
    int n = sparse->n_points, posed = 0;
    for (int i = 0; i < capture->n; i++) posed += sparse->pose[i].known;
    fs_log_info(&project->log,
                "poses: %d of %d photos, %d points (%d in flash photos only, %d in the others only), %.1f photos a "
                "point, %.2f pixels reprojection error",
                posed, capture->n, n, only[1], only[0], n ? (double)sparse->n_sightings / n : 0, n ? error / n : 0);
    if (n < 300)
        fs_log_warn(&project->log,
                    "only %d points were found: the scene has little texture, or the poses do not fit the photos", n);
}

// Of `count` photos without and with flash every Nth of each is to be held out, from the middle of the first N on.
static int check_held_out(const FsProject *project, const int count[2], FsError *err)
{
    int every = project->set.test_every, most = count[0] > count[1] ? count[0] : count[1];
    if (every == 0 || every / 2 < most) return 0;
    return fs_error_set(err, FS_ERR_USAGE,
                        "--test-every: %d would hold out none of the %d photos (%d without flash, %d with); give 0 for "
                        "none, or 2 to %d",
                        every, count[0] + count[1], count[0], count[1], 2 * most - 1);
}

// Which photos are held out is no reason to pose them again.
static int update_held_out(const FsProject *project, FsError *err)
{
    int rc = 0, count[2] = {0, 0};
    Dataset views = {0};
    FilePath path = fs_file_at("%s/views.json", project->out);
    TRY(fs_dataset_read(&views, path.text, err));
    for (int i = 0; i < views.n; i++) count[views.view[i].flash]++;
    TRY(check_held_out(project, count, err));
    if (fs_sparse_hold_out(&views, project->set.test_every)) {
        fs_log_info(&project->log, "poses: other photos are held out (--test-every %d)", project->set.test_every);
        TRY(fs_owned_check(path.text, err));
        fs_project_unmark(project, FS_STAGE_INITIALISE);
        TRY(fs_dataset_write(&views, path.text, err));
    }
fail:
    fs_dataset_free(&views);
    return rc;
}

double fs_poses_pixels(const FsProject *project, const RunSize *size)
{
    double longer = size->width > size->height ? size->width : size->height;
    double edge = fs_colmap_feature_edge(project, (int)longer) / longer;
    return fmin(size->picture_pixels, edge * edge * size->width * size->height);
}

// Before what they were posed with goes.
static int check_working_images(const FsProject *project, const Capture *capture, FsError *err)
{
    for (int i = 0; i < capture->n; i++)
        for (int k = 0; k < 2; k++) {
            FilePath name = fs_file_at("linear/%s%s", capture->photo[i].name, k ? "_mask.png" : ".tif");
            if (!fs_file_exists(fs_file_at("%s/%s", project->out, name.text).text))
                return fs_project_missing(project->out, FS_STAGE_INGEST, name.text, err);
        }
    return 0;
}

int fs_poses_check(const FsProject *project, FsError *err)
{
    bool posed = fs_file_exists(fs_file_at("%s/done/poses.json", project->out).text);
    return posed || *project->set.poses ? 0 : fs_colmap_check(project, err);
}

int fs_poses_run(FsProject *project, FsError *err)
{
    if (fs_project_done(project, FS_STAGE_POSES)) return update_held_out(project, err);
    int rc = 0, count[2] = {0, 0};
    Capture capture = {0};
    Sparse sparse = {0};
    if (*project->set.poses) TRY(fs_project_check_input(project, project->set.poses, err));
    TRY(fs_capture_read(project->out, &capture, err));
    for (int i = 0; i < capture.n; i++) count[capture.photo[i].flash]++;
    TRY(check_held_out(project, count, err));
    TRY(check_working_images(project, &capture, err));
    if (!*project->set.poses) TRY(fs_colmap_check(project, err));
    TRY(fs_project_begin(project, FS_STAGE_POSES, NULL, 0, err)); // what was there goes
    fs_owned_remove(fs_file_at("%s/" FS_OWNED_DIR "/colmap", project->out).text);
    TRY(fs_sparse_new(&sparse, &capture, err));
    TRY(reconstruct(project, &capture, &sparse, err));
    TRY(fs_sparse_write(&sparse, project, &capture, err));
    log_points(project, &capture, &sparse);
    TRY(fs_project_mark_done(project, FS_STAGE_POSES, err));
fail:
    fs_sparse_free(&sparse);
    fs_capture_free(&capture);
    return rc;
}

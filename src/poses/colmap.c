#include "poses/colmap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

#include "base/file.h"
#include "base/owned.h"
#include "base/process.h"
#include "poses/match.h"

#define SAME_FOCAL 0.015 // share by which a camera's focal length in EXIF may vary

enum { LEAST_FEATURE_EDGE = 600, ANY_FEATURE_EDGE = 3200 }; // pixels, the second COLMAP's own

typedef struct Option {
    const char *name, *value; // name NULL: the last one
} Option;

// Where its database takes no more, COLMAP ends well, with fewer features: a full disk, a quota or a limit on the size
// of files. The words are those of all versions so far.
static bool says_cut(const char *log_path)
{
    char *text = NULL;
    size_t size;
    bool said = fs_file_read(log_path, 64 << 20, &text, &size, NULL) == 0 && strstr(text, "SQLite error") &&
                !strstr(text, "unable to open database file");
    free(text);
    return said;
}

static int run_and_look(const Colmap *colmap, const char *const argv[], const char *log_path, FsError *err)
{
    struct statvfs disk;
    int rc = fs_process_run(argv, log_path, &colmap->project->log, err);
    if (rc < 0 && rc != FS_ERR_INPUT) return rc;
    if (statvfs(colmap->dir, &disk) == 0 && disk.f_bavail * disk.f_frsize < 1 << 16)
        rc = fs_error_set(err, FS_ERR_IO, "%s: COLMAP cannot write: No space left on device", colmap->dir);
    else if (says_cut(log_path))
        rc = fs_error_set(err, FS_ERR_IO,
                          "%s: COLMAP cannot write its database (what it said is in %s): is there a quota, or a limit "
                          "on the size of files (ulimit -f)? Give it room and run this again",
                          colmap->dir, log_path);
    return rc;
}

static int run(const Colmap *colmap, const char *command, const Option *option, const char *what, FsError *err)
{
    const char *program = colmap->project->set.colmap;
    const char *argv[64] = {"env", "QT_QPA_PLATFORM=offscreen", program,
                            command}; // a Qt program, and there may be no display
    for (int n = 4; option->name; option++) argv[n++] = option->name, argv[n++] = option->value;
    fs_log_progress(&colmap->project->log, "poses", 0, 0, what);
    int rc = run_and_look(colmap, argv, colmap->log_path, err);
    if (rc <= 0) return rc;
    return fs_error_input(err, "%s %s failed (exit status %d) while %s; what it said is in %s", program, command, rc,
                          what, colmap->log_path);
}

// Options of COLMAP 3.13 have other prefixes than before; its help tells.
static int look_at_options(Colmap *colmap, FsError *err)
{
    int rc = 0;
    FilePath path = fs_file_at("%s/help.txt", colmap->dir);
    char *text = NULL;
    size_t size;
    const char *argv[] = {"env", "QT_QPA_PLATFORM=offscreen", colmap->project->set.colmap, "feature_extractor", "-h",
                          NULL};
    TRY(run_and_look(colmap, argv, path.text, err));
    TRY(fs_file_read(path.text, 1 << 20, &text, &size, err));
    colmap->renamed_options = strstr(text, "FeatureExtraction.use_gpu") != NULL;
    colmap->renamed_size = strstr(text, "FeatureExtraction.max_image_size") != NULL;
    if (!strstr(text, "database_path"))
        rc = fs_error_input(err, "%s: does not answer like COLMAP; name the program with --colmap",
                            colmap->project->set.colmap);
fail:
    free(text);
    return rc;
}

static Lens prior_lens(const Photo *photo)
{
    int w = photo->picture_width, h = photo->picture_height;
    double guess = 1.2 * (w > h ? w : h), focal = photo->focal_px * ((double)w / photo->width);
    return (Lens){LENS_SIMPLE_RADIAL, w, h, {photo->focal_px > 0 ? focal : guess, 0.5 * w, 0.5 * h, 0}};
}

// Of one size, and of one focal length where both tell it.
static bool same_camera(const Photo *p, const Photo *q)
{
    bool known = p->focal_px > 0 && q->focal_px > 0, mm = p->focal_mm > 0 && q->focal_mm > 0;
    double ratio = known ? p->focal_px / q->focal_px : mm ? p->focal_mm / q->focal_mm : 1;
    return p->picture_width == q->picture_width && p->picture_height == q->picture_height &&
           fabs(ratio - 1) < SAME_FOCAL;
}

static bool one_camera(const Capture *cap)
{
    for (int i = 1; i < cap->n; i++)
        if (!same_camera(&cap->photo[0], &cap->photo[i])) return false;
    return true;
}

// One camera for all photos of one size and focal length.
static int enter_photos(Colmap *colmap, FsError *err)
{
    const Capture *cap = colmap->capture;
    int rc = 0, n_cameras = 0;
    int *camera = calloc((size_t)cap->n + 1, sizeof *camera);
    if (!camera) return fs_error_memory(err);
    TRY(fs_database_begin(colmap->db, err));
    for (int i = 0; i < cap->n; i++) {
        const Photo *p = &cap->photo[i];
        Lens lens = prior_lens(p);
        for (int j = 0; j < i && !camera[i]; j++) {
            const Photo *q = &cap->photo[j];
            if (same_camera(p, q)) camera[i] = camera[j];
        }
        if (!camera[i]) {
            camera[i] = ++n_cameras;
            TRY(fs_database_add_camera(colmap->db, camera[i], &lens, p->focal_px > 0, err));
        }
        TRY(fs_database_add_image(colmap->db, i + 1, p->picture, camera[i], err));
    }
    TRY(fs_database_end(colmap->db, err));
    if (n_cameras > 1)
        fs_log_warn(&colmap->project->log, "photos of %d sizes or focal lengths: each gets a camera of its own",
                    n_cameras);
fail:
    free(camera);
    return rc;
}

int fs_colmap_check(const FsProject *project, FsError *err)
{
    const char *program = project->set.colmap;
    if (strchr(program, '/') ? !fs_file_exists(program) : !fs_process_found(program))
        return fs_error_input(err,
                              "%s: program not found; install COLMAP (Debian: apt-get install colmap), name it with "
                              "--colmap, or give a model with poses and points with --poses",
                              program);
    if (strchr(project->out, '\\')) // it takes them for slashes
        return fs_error_input(err,
                              "%s: COLMAP cannot work in a folder with a backslash in its name: let the results go to "
                              "another, or give a model with poses and points with --poses",
                              project->out);
    return 0;
}

int fs_colmap_open(Colmap *colmap, const FsProject *project, const Capture *capture, FsError *err)
{
    int rc = 0;
    *colmap = (Colmap){.project = project, .capture = capture};
    MUST(fs_colmap_check(project, err));
    colmap->dir = fs_file_path("%s/" FS_OWNED_DIR "/colmap", project->out);
    colmap->database = fs_file_path("%s/" FS_OWNED_DIR "/colmap/database.db", project->out);
    colmap->log_path = fs_file_path("%s/" FS_OWNED_DIR "/colmap/log.txt", project->out);
    colmap->image_id = calloc((size_t)capture->n + 1, sizeof *colmap->image_id);
    if (!colmap->dir || !colmap->database || !colmap->log_path || !colmap->image_id) TRY(fs_error_memory(err));
    TRY(fs_file_mkdirs(colmap->dir, err));
    TRY(look_at_options(colmap, err));
    const Option options[] = {{"--database_path", colmap->database}, {NULL, NULL}};
    TRY(run(colmap, "database_creator", options, "starting COLMAP", err));
    TRY(fs_database_open(&colmap->db, colmap->database, err));
    // COLMAP numbers photos as its threads finish them; numbered by us, each run is the same.
    int frames;
    TRY(frames = fs_database_has_frames(colmap->db, err));
    rc = frames ? 0 : enter_photos(colmap, err);
fail:
    if (rc < 0) fs_colmap_close(colmap);
    return rc;
}

void fs_colmap_close(Colmap *colmap)
{
    fs_database_close(colmap->db);
    free(colmap->dir);
    free(colmap->database);
    free(colmap->log_path);
    free(colmap->image_id);
    *colmap = (Colmap){0};
}

// Known poses need points only, and not more exact ones than the working images are: twice their size.
int fs_colmap_feature_edge(const FsProject *project, int long_edge)
{
    if (!*project->set.poses) return ANY_FEATURE_EDGE;
    return 2 * long_edge > LEAST_FEATURE_EDGE ? 2 * long_edge : LEAST_FEATURE_EDGE;
}

static int longest_edge(const Capture *capture)
{
    int edge = 0;
    for (int i = 0; i < capture->n; i++) {
        const Photo *p = &capture->photo[i];
        int longer = p->width > p->height ? p->width : p->height;
        edge = longer > edge ? longer : edge;
    }
    return edge;
}

int fs_colmap_extract(Colmap *colmap, Features *features, FsError *err)
{
    const Capture *cap = colmap->capture;
    int frames = fs_database_has_frames(colmap->db, err);
    if (frames < 0) return frames;
    Lens lens = prior_lens(&cap->photo[0]);
    int wanted = colmap->project->set.threads;
    FilePath masks = fs_file_at("%s_masks", cap->pictures); // what ingest was given
    bool masked = fs_file_exists(masks.text);
    char threads[16], edge[16], params[100];
    snprintf(edge, sizeof edge, "%d", fs_colmap_feature_edge(colmap->project, longest_edge(cap)));
    snprintf(threads, sizeof threads, "%d", frames ? 1 : wanted > 0 ? wanted : -1);
    snprintf(params, sizeof params, "%.17g,%.17g,%.17g,0", lens.param[0], lens.param[1], lens.param[2]);
    const Option options[] = {
        {"--ImageReader.mask_path", masks.text}, // first: left out where there are none
        {"--database_path", colmap->database},
        {"--image_path", cap->pictures},
        {colmap->renamed_options ? "--FeatureExtraction.use_gpu" : "--SiftExtraction.use_gpu", "0"},
        {colmap->renamed_options ? "--FeatureExtraction.num_threads" : "--SiftExtraction.num_threads", threads},
        // Mirrored things have little contrast: many weak features, sorted out by geometry later.
        {"--SiftExtraction.peak_threshold", "0.001"},
        {"--SiftExtraction.edge_threshold", "16"},
        {"--SiftExtraction.max_num_features", "10000"},
        {colmap->renamed_size ? "--FeatureExtraction.max_image_size" : "--SiftExtraction.max_image_size", edge},
        {frames ? "--ImageReader.camera_model" : NULL, "SIMPLE_RADIAL"}, // COLMAP enters the photos itself
        {one_camera(cap) ? "--ImageReader.single_camera" : NULL, "1"},   // else each photo has its own
        {"--ImageReader.camera_params", params},
        {NULL, NULL}};
    MUST(run(colmap, "feature_extractor", masked ? options : options + 1, "looking for features", err));
    for (int i = 0; i < cap->n; i++) {
        MUST(colmap->image_id[i] = fs_database_image(colmap->db, cap->photo[i].picture, err));
        if (colmap->image_id[i]) MUST(fs_database_features(colmap->db, colmap->image_id[i], &features[i], err));
        if (features[i].n < FS_COLMAP_FEW_FEATURES)
            fs_log_warn(&colmap->project->log, "%s: only %d features; is it sharp and well exposed?",
                        cap->photo[i].name, features[i].n);
    }
    return 0;
}

int fs_colmap_verify(Colmap *colmap, const MatchList *list, FsError *err)
{
    const Option options[] = {
        {"--database_path", colmap->database},
        {colmap->renamed_options ? "--FeatureMatching.use_gpu" : "--SiftMatching.use_gpu", "0"},
        // Random samples are drawn per thread: one thread, one result.
        {colmap->renamed_options ? "--FeatureMatching.num_threads" : "--SiftMatching.num_threads", "1"},
        {"--random_seed", "0"},
        {NULL, NULL}};
    MUST(fs_database_begin(colmap->db, err));
    for (int j = 0; j < colmap->capture->n; j++)
        for (int i = 0; i < j; i++)
            if (colmap->image_id[i] && colmap->image_id[j])
                MUST(fs_database_add_matches(colmap->db, colmap->image_id[i], colmap->image_id[j],
                                             &list[fs_match_pair(i, j)], err));
    MUST(fs_database_end(colmap->db, err));
    // Does not match what is matched: it verifies.
    return run(colmap, "exhaustive_matcher", options, "verifying matches", err);
}

static int write_list(const Colmap *colmap, int group, const char *path, FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    for (int i = 0; i < colmap->capture->n; i++)
        if (group < 0 || colmap->capture->photo[i].flash == group)
            fprintf(file.f, "%s\n", colmap->capture->photo[i].picture);
    return fs_file_commit(&file, err);
}

// Reads <dir>/0, <dir>/1, ... and keeps the model with most photos.
static int take_largest(const char *dir, ColmapModel *model, FsError *err)
{
    for (int k = 0; k < 50; k++) {
        ColmapModel next;
        FilePath path = fs_file_at("%s/%d", dir, k);
        if (!fs_file_is_dir(path.text)) break;
        MUST(fs_colmap_model_read(path.text, &next, err));
        if (next.n_images > model->n_images) {
            ColmapModel old = *model;
            *model = next;
            next = old;
        }
        fs_colmap_model_free(&next);
    }
    return 0;
}

// failure: why COLMAP ended with an error, which it also does where it found no model.
static int map_once(Colmap *colmap, int group, bool lenient, ColmapModel *model, FsError *failure, FsError *err)
{
    static const char *const names[] = {"all", "noflash", "flash"};
    FilePath dir = fs_file_at("%s/%s%s", colmap->dir, names[group + 1], lenient ? "-lenient" : "");
    FilePath list = fs_file_at("%s.txt", dir.text);
    char inliers[16];
    snprintf(inliers, sizeof inliers, "%d", FS_COLMAP_FEW_MATCHES);
    MUST(fs_file_mkdirs(dir.text, err));
    MUST(write_list(colmap, group, list.text, err));
    const Option options[] = {{"--database_path", colmap->database},
                              {"--image_path", colmap->capture->pictures},
                              {"--output_path", dir.text},
                              {"--image_list_path", list.text},
                              {"--random_seed", "0"},
                              {"--Mapper.num_threads", "1"}, // sums in the solver depend on their order
                              {"--Mapper.min_model_size", "3"},
                              {"--Mapper.max_num_models", "10"},
                              {"--Mapper.ba_refine_principal_point", "0"},
                              {lenient ? "--Mapper.init_min_num_inliers" : NULL, "40"},
                              {"--Mapper.init_min_tri_angle", "4"},
                              {"--Mapper.abs_pose_min_num_inliers", inliers},
                              {"--Mapper.abs_pose_min_inlier_ratio", "0.1"},
                              {"--Mapper.max_reg_trials", "6"},
                              {NULL, NULL}};
    static const char *const what[] = {"finding poses", "finding poses of the no-flash photos",
                                       "finding poses of the flash photos"};
    int rc = run(colmap, "mapper", options, what[group + 1], failure);
    if (rc < 0 && rc != FS_ERR_INPUT) return fs_error_set(err, rc, "%s", failure->message);
    return take_largest(dir.text, model, err);
}

// The photos are to blame: the words are those of all versions so far.
static bool says_no_model(const Colmap *colmap)
{
    char *text = NULL;
    size_t size;
    bool said = fs_file_read(colmap->log_path, 64 << 20, &text, &size, NULL) == 0 &&
                strstr(text, "failed to create sparse model");
    free(text);
    return said;
}

int fs_colmap_map(Colmap *colmap, int group, ColmapModel *model, FsError *err)
{
    *model = (ColmapModel){0};
    int rc = 0, wanted = 0;
    FsError failure = {0};
    for (int i = 0; i < colmap->capture->n; i++) wanted += group < 0 || colmap->capture->photo[i].flash == group;
    TRY(map_once(colmap, group, false, model, &failure, err));
    if (model->n_images < wanted) {
        fs_log_info(&colmap->project->log, "poses: %d of %d photos posed; trying again with lower demands",
                    model->n_images, wanted);
        TRY(map_once(colmap, group, true, model, &failure, err));
    }
    if (!model->n_images && failure.code && !says_no_model(colmap))
        rc = fs_error_set(err, failure.code, "%s", failure.message);
fail:
    if (rc < 0) fs_colmap_model_free(model);
    return rc;
}

int fs_colmap_adjust(Colmap *colmap, const char *from, const char *to, FsError *err)
{
    MUST(fs_file_mkdirs(to, err));
    const Option options[] = {
        {"--input_path", from}, {"--output_path", to}, {"--BundleAdjustment.max_num_iterations", "40"}, {NULL, NULL}};
    return run(colmap, "bundle_adjuster", options, "refining poses", err);
}

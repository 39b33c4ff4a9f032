#include "poses/colmap.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"
#include "base/process.h"
#include "poses/match.h"

enum { MAX_ARGS = 64 };

typedef struct Command {
    char *arg[MAX_ARGS];
    int n;
    bool failed;
} Command;

__attribute__((format(printf, 2, 3))) static void add(Command *c, const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    char *s = NULL;
    if (c->n >= MAX_ARGS - 1 || vasprintf(&s, format, ap) < 0)
        c->failed = true;
    else
        c->arg[c->n++] = s;
    va_end(ap);
}

static void add_pair(Command *c, const char *name, const char *value)
{
    add(c, "--%s", name);
    add(c, "%s", value);
}

// Runs and frees the command.
static int run(const Colmap *colmap, Command *c, const char *what, FsError *err)
{
    int rc = c->failed ? fs_error_memory(err) : 0;
    c->arg[c->n] = NULL;
    if (rc == 0) {
        fs_log_progress(&colmap->project->log, "poses", 0, 0, what);
        rc = fs_process_run((const char *const *)c->arg, colmap->log_path, &colmap->project->log, err);
    }
    if (rc > 0)
        rc = fs_error_set(err, FS_ERR_INPUT, "%s %s failed (exit status %d) while %s; what it said is in %s", c->arg[2],
                          c->arg[3], rc, what, colmap->log_path);
    for (int i = 0; i < c->n; i++) free(c->arg[i]);
    *c = (Command){0};
    return rc;
}

static Command start(const Colmap *colmap, const char *command)
{
    Command c = {0};
    add(&c, "env");
    add(&c, "QT_QPA_PLATFORM=offscreen"); // COLMAP is a Qt program, and there may be no display
    add(&c, "%s", colmap->project->set.colmap);
    add(&c, "%s", command);
    return c;
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
    rc = fs_process_run(argv, path.text, &colmap->project->log, err);
    if (rc < 0) goto fail;
    TRY(fs_file_read(path.text, 1 << 20, &text, &size, err));
    colmap->renamed_options = strstr(text, "FeatureExtraction.use_gpu") != NULL;
    if (!strstr(text, "database_path"))
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: does not answer like COLMAP; name the program with --colmap",
                          colmap->project->set.colmap);
fail:
    free(text);
    return rc;
}

static double focal_or_guess(const Photo *photo)
{
    double scale = (double)photo->picture_width / photo->width;
    double side = photo->picture_width > photo->picture_height ? photo->picture_width : photo->picture_height;
    return photo->focal_px > 0 ? photo->focal_px * scale : 1.2 * side;
}

static Lens prior_lens(const Photo *photo)
{
    return (Lens){.model = LENS_SIMPLE_RADIAL,
                  .width = photo->picture_width,
                  .height = photo->picture_height,
                  .param = {focal_or_guess(photo), 0.5 * photo->picture_width, 0.5 * photo->picture_height, 0}};
}

// One camera for all photos of one size.
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
            bool same = p->picture_width == q->picture_width && p->picture_height == q->picture_height;
            if (same) camera[i] = camera[j];
        }
        if (!camera[i]) {
            camera[i] = ++n_cameras;
            TRY(fs_database_add_camera(colmap->db, camera[i], &lens, p->focal_px > 0, err));
        }
        TRY(fs_database_add_image(colmap->db, i + 1, p->picture, camera[i], err));
    }
    TRY(fs_database_end(colmap->db, err));
    if (n_cameras > 1)
        fs_log_warn(&colmap->project->log, "photos of %d sizes: each size gets a camera of its own", n_cameras);
fail:
    free(camera);
    return rc;
}

int fs_colmap_open(Colmap *colmap, const FsProject *project, const Capture *capture, FsError *err)
{
    int rc = 0;
    *colmap = (Colmap){.project = project, .capture = capture};
    const char *program = project->set.colmap;
    if (strchr(program, '/') ? !fs_file_exists(program) : !fs_process_found(program))
        return fs_error_set(err, FS_ERR_INPUT,
                            "%s: program not found; install COLMAP (Debian: apt-get install colmap), name it "
                            "with --colmap, or give a model with poses and points with --poses",
                            program);
    colmap->dir = fs_file_path("%s/" FS_OWNED_DIR "/colmap", project->out);
    colmap->database = fs_file_path("%s/" FS_OWNED_DIR "/colmap/database.db", project->out);
    colmap->log_path = fs_file_path("%s/" FS_OWNED_DIR "/colmap/log.txt", project->out);
    colmap->image_id = calloc((size_t)capture->n + 1, sizeof *colmap->image_id);
    if (!colmap->dir || !colmap->database || !colmap->log_path || !colmap->image_id) TRY(fs_error_memory(err));
    TRY(fs_file_mkdirs(colmap->dir, err));
    TRY(look_at_options(colmap, err));
    Command c = start(colmap, "database_creator");
    add_pair(&c, "database_path", colmap->database);
    TRY(run(colmap, &c, "starting COLMAP", err));
    TRY(fs_database_open(&colmap->db, colmap->database, err));
    // COLMAP numbers photos as its threads finish them; numbered by us, each run is the same.
    if (!fs_database_has_frames(colmap->db)) TRY(enter_photos(colmap, err));
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

int fs_colmap_extract(Colmap *colmap, Features *features, FsError *err)
{
    int rc = 0;
    const Capture *cap = colmap->capture;
    bool frames = fs_database_has_frames(colmap->db);
    const char *general = colmap->renamed_options ? "FeatureExtraction" : "SiftExtraction";
    Command c = start(colmap, "feature_extractor");
    add_pair(&c, "database_path", colmap->database);
    add_pair(&c, "image_path", cap->pictures);
    if (frames) { // COLMAP enters the photos itself
        Lens lens = prior_lens(&cap->photo[0]);
        add_pair(&c, "ImageReader.camera_model", "SIMPLE_RADIAL");
        add_pair(&c, "ImageReader.single_camera", "1");
        add(&c, "--ImageReader.camera_params");
        add(&c, "%.17g,%.17g,%.17g,0", lens.param[0], lens.param[1], lens.param[2]);
    }
    add(&c, "--%s.use_gpu", general);
    add(&c, "0");
    add(&c, "--%s.num_threads", general);
    add(&c, "%d", frames ? 1 : colmap->project->set.threads > 0 ? colmap->project->set.threads : -1);
    // Mirrored things have little contrast: many weak features, sorted out by geometry later.
    add_pair(&c, "SiftExtraction.peak_threshold", "0.001");
    add_pair(&c, "SiftExtraction.edge_threshold", "16");
    add_pair(&c, "SiftExtraction.max_num_features", "10000");
    TRY(run(colmap, &c, "looking for features", err));
    for (int i = 0; i < cap->n; i++) {
        colmap->image_id[i] = fs_database_image(colmap->db, cap->photo[i].picture);
        if (colmap->image_id[i]) TRY(fs_database_features(colmap->db, colmap->image_id[i], &features[i], err));
        if (features[i].n < 50)
            fs_log_warn(&colmap->project->log, "%s: only %d features; is it sharp and well exposed?",
                        cap->photo[i].name, features[i].n);
    }
fail:
    return rc;
}

int fs_colmap_verify(Colmap *colmap, const MatchList *list, FsError *err)
{
    int rc = 0;
    const char *general = colmap->renamed_options ? "FeatureMatching" : "SiftMatching";
    TRY(fs_database_begin(colmap->db, err));
    for (int j = 0; j < colmap->capture->n; j++)
        for (int i = 0; i < j; i++)
            if (colmap->image_id[i] && colmap->image_id[j])
                TRY(fs_database_add_matches(colmap->db, colmap->image_id[i], colmap->image_id[j],
                                            &list[fs_match_pair(i, j)], err));
    TRY(fs_database_end(colmap->db, err));
    Command c = start(colmap, "exhaustive_matcher"); // does not match what is matched: it verifies
    add_pair(&c, "database_path", colmap->database);
    add(&c, "--%s.use_gpu", general);
    add(&c, "0");
    add(&c, "--%s.num_threads", general); // random samples are drawn per thread: one thread, one result
    add(&c, "1");
    add_pair(&c, "random_seed", "0");
    TRY(run(colmap, &c, "verifying matches", err));
fail:
    return rc;
}

static int write_list(const Colmap *colmap, int group, const char *path, FsError *err)
{
    AtomicFile file;
    int rc = fs_file_begin(&file, path, err);
    if (rc < 0) return rc;
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
        int rc = fs_colmap_model_read(path.text, &next, err);
        if (rc < 0) return rc;
        if (next.n_images > model->n_images) {
            ColmapModel old = *model;
            *model = next;
            next = old;
        }
        fs_colmap_model_free(&next);
    }
    return 0;
}

static int map_once(Colmap *colmap, int group, bool lenient, ColmapModel *model, FsError *err)
{
    int rc = 0;
    static const char *const names[] = {"all", "noflash", "flash"};
    FilePath dir = fs_file_at("%s/%s%s", colmap->dir, names[group + 1], lenient ? "-lenient" : "");
    FilePath list = fs_file_at("%s.txt", dir.text);
    TRY(fs_file_mkdirs(dir.text, err));
    TRY(write_list(colmap, group, list.text, err));
    Command c = start(colmap, "mapper");
    add_pair(&c, "database_path", colmap->database);
    add_pair(&c, "image_path", colmap->capture->pictures);
    add_pair(&c, "output_path", dir.text);
    add_pair(&c, "image_list_path", list.text);
    add_pair(&c, "random_seed", "0");
    add_pair(&c, "Mapper.num_threads", "1"); // sums in the solver depend on their order
    add_pair(&c, "Mapper.min_model_size", "3");
    add_pair(&c, "Mapper.max_num_models", "10");
    add_pair(&c, "Mapper.ba_refine_principal_point", "0");
    if (lenient) {
        add_pair(&c, "Mapper.init_min_num_inliers", "40");
        add_pair(&c, "Mapper.init_min_tri_angle", "4");
        add_pair(&c, "Mapper.abs_pose_min_num_inliers", "15");
        add_pair(&c, "Mapper.abs_pose_min_inlier_ratio", "0.1");
        add_pair(&c, "Mapper.max_reg_trials", "6");
    }
    FsError inner = {0};
    rc = run(colmap, &c,
             group < 0 ? "finding poses"
             : group   ? "finding poses of the flash photos"
                       : "finding poses of the no-flash photos",
             &inner);
    if (rc == FS_ERR_CANCELLED || rc == FS_ERR_MEMORY) {
        if (err) *err = inner;
        goto fail;
    }
    rc = take_largest(dir.text, model, err); // a mapper that found nothing also ends with an error
fail:
    return rc;
}

int fs_colmap_map(Colmap *colmap, int group, ColmapModel *model, FsError *err)
{
    *model = (ColmapModel){0};
    int rc = 0, wanted = 0;
    for (int i = 0; i < colmap->capture->n; i++) wanted += group < 0 || colmap->capture->photo[i].flash == group;
    TRY(map_once(colmap, group, false, model, err));
    if (model->n_images < wanted) {
        fs_log_info(&colmap->project->log, "poses: %d of %d photos posed; trying again with lower demands",
                    model->n_images, wanted);
        TRY(map_once(colmap, group, true, model, err));
    }
fail:
    if (rc < 0) fs_colmap_model_free(model);
    return rc;
}

int fs_colmap_adjust(Colmap *colmap, const char *from, const char *to, FsError *err)
{
    int rc = 0;
    TRY(fs_file_mkdirs(to, err));
    Command c = start(colmap, "bundle_adjuster");
    add_pair(&c, "input_path", from);
    add_pair(&c, "output_path", to);
    add_pair(&c, "BundleAdjustment.max_num_iterations", "40");
    TRY(run(colmap, &c, "refining poses", err));
fail:
    return rc;
}

#include "export/trainer_dataset.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/linalg.h"
#include "base/owned.h"
#include "engine/engine.h"
#include "export/splats.h"
#include "image/tone.h"
#include "model/colmap_model.h"

#define MOST_POINTS 100000

typedef struct Trainer {
    const ExportArgs *args;
    bool photos;    // as they are
    Engine *engine; // of T
    Renders renders;
    ColmapModel model;
} Trainer;

static int add_camera(ColmapModel *model, const Camera *camera, uint32_t *id, FsError *err)
{
    Lens lens = fs_lens_from_camera(camera);
    for (int k = 0; k < model->n_cameras; k++)
        if (fs_lens_equal(&model->camera[k].lens, &lens)) {
            *id = model->camera[k].id;
            return 0;
        }
    ColmapCamera *added = fs_colmap_model_add_camera(model, err);
    if (!added) return FS_ERR_MEMORY;
    *id = (uint32_t)model->n_cameras;
    *added = (ColmapCamera){*id, lens};
    return 0;
}

static int render_transmitted(Trainer *t, const View *view, const char *path, FsError *err)
{
    MUST(fs_engine_render(t->engine, &view->camera, &t->renders, err));
    Image *picture = &t->renders.layer[RENDER_T_N];
    for (size_t i = 0; i < fs_image_pixels(picture); i++)
        fs_preview_develop(&t->args->development->light, picture->px + 3 * i);
    return fs_png_write(path, picture, 8, err);
}

// As COLMAP has it, black where there is no photo: outside of what its lens saw, and where the user's mask is.
static int write_mask(const Trainer *t, const View *view, const Image *photo, FsError *err)
{
    Image mask;
    const char *out = t->args->project->out;
    MUST(fs_png_read(fs_file_at("%s/images/%s_mask.png", out, view->name).text, &mask, err));
    bool fits = mask.channels == 1 && mask.width == photo->width && mask.height == photo->height;
    for (size_t i = 0; fits && i < fs_image_pixels(photo); i++) {
        const float *p = photo->px + 3 * i;
        mask.px[i] = mask.px[i] > 0 || p[0] != 0 || p[1] != 0 || p[2] != 0; // what is clipped is no hole
    }
    int rc = fits ? fs_png_write(fs_file_at("%s/export/dataset/masks/%s.png.png", out, view->name).text, &mask, 8, err)
                  : fs_error_input(err,
                                   "%s/images/%s_mask.png: not the mask of its photo: rerun the stage poses with "
                                   "--force",
                                   out, view->name);
    fs_image_free(&mask);
    return rc;
}

static int encode_photo(const Trainer *t, const View *view, const char *path, FsError *err)
{
    Image photo;
    MUST(fs_tiff_read(fs_file_at("%s/images/%s.tif", t->args->project->out, view->name).text, &photo, err));
    int rc = write_mask(t, view, &photo, err);
    for (size_t i = 0; i < fs_image_values(&photo); i++) photo.px[i] = fs_tone_srgb_encode(photo.px[i]);
    if (rc == 0) rc = fs_png_write(path, &photo, 8, err);
    fs_image_free(&photo);
    return rc;
}

static int add_photo(Trainer *t, const View *view, FsError *err)
{
    FilePath name = fs_file_at("%s.png", view->name);
    FilePath path = fs_file_at("%s/export/dataset/images/%s", t->args->project->out, name.text);
    uint32_t camera_id;
    MUST(add_camera(&t->model, &view->camera, &camera_id, err));
    ColmapImage *image = fs_colmap_model_add_image(&t->model, name.text, err);
    if (!image) return FS_ERR_MEMORY;
    image->id = (uint32_t)t->model.n_images;
    image->camera_id = camera_id;
    fs_camera_pose_to_quat(view->camera.w2c, image->quat, image->t);
    return t->photos ? encode_photo(t, view, path.text, err) : render_transmitted(t, view, path.text, err);
}

// Of each flash photo the nearest without, between tabs: names may have spaces.
static int write_pairs(const Trainer *t, FsError *err)
{
    const Dataset *photos = t->args->photos;
    AtomicFile file;
    MUST(fs_file_begin(&file, fs_file_at("%s/export/dataset/pairs.txt", t->args->project->out).text, err));
    for (int i = 0; i < photos->n; i++) {
        const View *flash = &photos->view[i], *nearest = NULL;
        double least = INFINITY, a[3], b[3];
        fs_camera_centre(&flash->camera, a);
        for (int j = 0; j < photos->n && flash->flash; j++) {
            fs_camera_centre(&photos->view[j].camera, b);
            if (photos->view[j].flash || v3_distance2(a, b) >= least) continue;
            least = v3_distance2(a, b);
            nearest = &photos->view[j];
        }
        if (nearest) fprintf(file.f, "%s.png\t%s.png\t%.6g\n", flash->name, nearest->name, sqrt(least));
    }
    return fs_file_commit(&file, err);
}

static int add_point(Trainer *t, const double xyz[3], const unsigned char rgb[3], FsError *err)
{
    ColmapPoint *point = fs_colmap_model_add_point(&t->model, err);
    if (!point) return FS_ERR_MEMORY;
    point->id = t->model.n_points;
    memcpy(point->xyz, xyz, sizeof point->xyz);
    memcpy(point->rgb, rgb, sizeof point->rgb);
    return 0;
}

static int add_points_of_poses(Trainer *t, FsError *err)
{
    ColmapModel model;
    int rc = fs_colmap_model_read(fs_file_at("%s/sparse", t->args->project->out).text, &model, err);
    for (int i = 0; i < model.n_points && rc == 0; i++) rc = add_point(t, model.point[i].xyz, model.point[i].rgb, err);
    fs_colmap_model_free(&model);
    return rc;
}

// The middles of Gaussians that are at least half opaque (of all, where none is), evenly chosen, for trainers to start
// from.
static int add_points(Trainer *t, const Cloud *cloud, FsError *err)
{
    Splats splats = {0};
    int rc = 0, opaque = 0, seen = 0;
    float *srgb = malloc(sizeof(float) * 3 * ((size_t)cloud->n + 1));
    if (!srgb) return fs_error_memory(err);
    fs_colors_display(t->args->scene, LAYER_T_N, t->args->development, srgb);
    TRY(fs_splats_make(cloud, srgb, &splats, err));
    for (int i = 0; i < splats.n; i++) opaque += splats.opacity[i] >= 0;
    int each = ((opaque ? opaque : splats.n) + MOST_POINTS - 1) / MOST_POINTS;
    for (size_t i = 0; i < (size_t)splats.n; i++) {
        if ((opaque && splats.opacity[i] < 0) || seen++ % each) continue;
        double xyz[3];
        unsigned char rgb[3];
        for (size_t a = 0; a < 3; a++) {
            xyz[a] = (double)splats.mean[3 * i + a];
            rgb[a] = (unsigned char)fs_splats_level(255 * (double)splats.srgb[3 * i + a], 255);
        }
        TRY(add_point(t, xyz, rgb, err));
    }
fail:
    fs_splats_free(&splats);
    free(srgb);
    return rc;
}

static int write_photos(Trainer *t, FsError *err)
{
    const Log *log = &t->args->project->log;
    const Dataset *photos = t->args->photos;
    MUST(fs_file_mkdirs(fs_file_at("%s/export/dataset/images", t->args->project->out).text, err));
    if (t->photos) MUST(fs_file_mkdirs(fs_file_at("%s/export/dataset/masks", t->args->project->out).text, err));
    for (int v = 0; v < photos->n; v++) {
        if (fs_log_cancelled(log)) return fs_error_set(err, FS_ERR_CANCELLED, "export: stopped");
        fs_log_progress(log, "export", v, photos->n, "dataset");
        MUST(add_photo(t, &photos->view[v], err));
    }
    return 0;
}

int fs_trainer_dataset_run(const ExportArgs *args, FsError *err)
{
    const Settings *set = &args->project->set;
    const Cloud *cloud = fs_colors_cloud(args->scene, LAYER_T_N);
    Trainer t = {.args = args, .photos = strcmp(set->dataset_of, "photos") == 0};
    int rc = 0;
    FilePath dir = fs_file_at("%s/export/dataset", args->project->out);
    if (!args->photos->n)
        return fs_error_input(err, "%s/views.json: missing or without photos: no dataset without", args->project->out);
    if (!cloud && !t.photos)
        return fs_error_input(err,
                              "%s/clouds: %s, so there are no points for a dataset of T_N to begin with; "
                              "--dataset-of photos makes one of the photos",
                              args->project->out,
                              fs_radiance_is(&args->scene->field) ? "the scene is a radiance field" : "no T_N");
    fs_owned_remove(dir.text); // one of the other kind would be mixed with it
    if (!t.photos) TRY(fs_engine_new(&t.engine, set->device, set->cpu, set->threads, err));
    if (!t.photos) TRY(fs_engine_scene_up(t.engine, args->scene, err));
    TRY(write_photos(&t, err));
    TRY(t.photos ? add_points_of_poses(&t, err) : add_points(&t, cloud, err));
    if (t.photos) TRY(write_pairs(&t, err));
    TRY(fs_colmap_model_write(fs_file_at("%s/sparse/0", dir.text).text, &t.model, true, err));
    fs_log_info(&args->project->log, "export: %d photos%s and %d points, for other programs: %s", t.model.n_images,
                t.photos ? "" : " without the reflection", t.model.n_points, dir.text);
fail:
    fs_colmap_model_free(&t.model);
    fs_engine_renders_free(&t.renders);
    fs_engine_free(t.engine);
    return rc;
}

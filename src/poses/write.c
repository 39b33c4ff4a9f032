// What poses leaves on disk: undistorted photos and masks, the sparse model, the views.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "model/dataset.h"
#include "poses/sparse.h"
#include "poses/undistort.h"

typedef struct Work {
    const Sparse *sparse;
    const Capture *capture;
    const char *out;
    const int *photo; // of each job
    int first;
    FsError *failure; // per photo
} Work;

static int read_photo(const char *out, const char *kind, const Photo *photo, Image *rgb, Image *mask, FsError *err)
{
    FilePath path = fs_file_at("%s/%s/%s.tif", out, kind, photo->name);
    MUST(fs_tiff_read(path.text, rgb, err));
    MUST(fs_png_read(fs_file_at("%s/%s/%s_mask.png", out, kind, photo->name).text, mask, err));
    if (rgb->channels == 3 && mask->channels == 1 && mask->width == rgb->width && mask->height == rgb->height &&
        rgb->width >= photo->width && rgb->height >= photo->height)
        return 0;
    return fs_error_input(err, "%s: not what the stage ingest writes; rerun it with --force", path.text);
}

// Both without the distortion, at working size. What `kind` has more pixels is averaged afterwards, which keeps what
// sampling between the pixels would blur.
static int undistort(const Work *w, const char *kind, int photo, Image *rgb, Image *mask, FsError *err)
{
    const Pose *pose = &w->sparse->pose[photo];
    const Photo *p = &w->capture->photo[photo];
    Image fine = {0}, fine_mask = {0};
    int rc = 0;
    TRY(read_photo(w->out, kind, p, &fine, &fine_mask, err));
    Lens lens = fs_lens_resized(&pose->lens, fine.width, fine.height);
    Camera camera = fs_camera_resized(&pose->camera, fine.width, fine.height);
    TRY(fs_undistort(&lens, &camera, &fine, &fine_mask, err));
    TRY(fs_image_resize_area(&fine, p->width, p->height, rgb, err));
    TRY(fs_image_resize_area(&fine_mask, p->width, p->height, mask, err));
    for (size_t i = 0; i < fs_image_pixels(mask); i++)
        mask->px[i] = mask->px[i] > 1 - 1e-4f ? 1 : mask->px[i] >= FS_MASK_PART ? FS_MASK_PART : 0;
fail:
    fs_image_free(&fine);
    fs_image_free(&fine_mask);
    return rc;
}

static int write_undistorted(const Work *w, int photo, const FilePath to[2], FsError *err)
{
    int rc = 0;
    const char *name = w->capture->photo[photo].name;
    Image rgb = {0}, mask = {0}, fine = {0}, fine_mask = {0};
    TRY(undistort(w, "linear", photo, &rgb, &mask, err));
    if (fs_file_exists(fs_file_at("%s/linear/fine/%s.tif", w->out, name).text)) {
        TRY(undistort(w, "linear/fine", photo, &fine, &fine_mask, err));
        for (size_t i = 0; i < fs_image_pixels(&mask); i++) mask.px[i] = fminf(mask.px[i], fine_mask.px[i]);
    }
    TRY(fs_tiff_write_float(to[0].text, fine.px ? &fine : &rgb, err));
    TRY(fs_png_write(to[1].text, &mask, 8, err));
fail:
    for (int i = 0; i < 4; i++) fs_image_free((Image *[]){&rgb, &mask, &fine, &fine_mask}[i]);
    return rc;
}

static void write_photo(void *context, int job, int worker)
{
    (void)worker;
    const Work *w = context;
    int i = w->photo[w->first + job];
    const Photo *photo = &w->capture->photo[i];
    FsError *err = &w->failure[i];
    const FilePath from[2] = {fs_file_at("%s/linear/%s.tif", w->out, photo->name),
                              fs_file_at("%s/linear/%s_mask.png", w->out, photo->name)};
    const FilePath to[2] = {fs_file_at("%s/images/%s.tif", w->out, photo->name),
                            fs_file_at("%s/images/%s_mask.png", w->out, photo->name)};
    if (!fs_lens_is_pinhole(&w->sparse->pose[i].lens))
        write_undistorted(w, i, to, err);
    else if (fs_file_link(from[0].text, to[0].text, err) == 0)
        fs_file_link(from[1].text, to[1].text, err);
}

static int write_photos(const Sparse *sparse, const FsProject *project, const Capture *capture, FsError *err)
{
    int rc = 0, n = 0;
    Threads *threads = fs_threads_new(project->set.threads);
    FsError *failure = calloc((size_t)capture->n + 1, sizeof *failure);
    int *photo = calloc((size_t)capture->n + 1, sizeof *photo), step = 4 * fs_threads_count(threads);
    Work work = {sparse, capture, project->out, photo, 0, failure};
    if (!threads || !failure || !photo) TRY(fs_error_memory(err));
    TRY(fs_file_mkdirs(fs_file_at("%s/images", project->out).text, err));
    for (int i = 0; i < capture->n; i++)
        if (sparse->pose[i].known) photo[n++] = i;
    for (; work.first < n; work.first += step) {
        fs_log_progress(&project->log, "poses", work.first, n, "undoing lens distortion");
        if (fs_log_cancelled(&project->log))
            TRY(fs_error_set(err, FS_ERR_CANCELLED, "poses: cancelled while writing photos"));
        fs_threads_for(threads, step < n - work.first ? step : n - work.first, write_photo, &work);
    }
    TRY(fs_error_first(failure, (size_t)capture->n, err));
fail:
    fs_threads_free(threads);
    free(failure);
    free(photo);
    return rc;
}

bool fs_sparse_hold_out(Dataset *views, int every)
{
    int count[2] = {0, 0};
    bool changed = false;
    for (int i = 0; i < views->n; i++) { // every Nth of each lighting: what is held out shows both
        View *v = &views->view[i];
        bool held_out = every > 0 && count[v->flash]++ % every == every / 2;
        changed |= held_out != v->held_out;
        v->held_out = held_out;
    }
    return changed;
}

static int write_views(const Sparse *sparse, const FsProject *project, const Capture *capture, FsError *err)
{
    int rc = 0;
    Dataset views = {0};
    for (int i = 0; i < capture->n; i++) {
        if (!sparse->pose[i].known) continue;
        const Pose *pose = &sparse->pose[i];
        View view = {.name = capture->photo[i].name,
                     .flash = capture->photo[i].flash,
                     .flash_gain = capture->photo[i].flash_gain,
                     .exposure_gain = capture->photo[i].exposure_gain,
                     .brightness = capture->photo[i].brightness,
                     .sharpness = capture->photo[i].sharpness,
                     .encoded = capture->photo[i].encoded,
                     .camera = fs_camera_resized(&pose->camera, capture->photo[i].width, capture->photo[i].height),
                     .lens = fs_lens_resized(&pose->lens, capture->photo[i].width, capture->photo[i].height)};
        view.distorted = !fs_lens_is_pinhole(&view.lens);
        TRY(fs_dataset_append(&views, &view, err));
    }
    bool held_out = fs_sparse_hold_out(&views, project->set.test_every); // from none
    if (project->set.test_every > 0 && !held_out)
        fs_log_warn(&project->log, "poses: --test-every %d holds out none of the %d photos with a pose",
                    project->set.test_every, views.n);
    TRY(fs_dataset_write(&views, fs_file_at("%s/views.json", project->out).text, err));
fail:
    fs_dataset_free(&views);
    return rc;
}

// ---- the sparse model ----

typedef struct Build {
    const Sparse *sparse;
    const Capture *capture;
    int least;
    bool as_taken;
    uint32_t *index; // (sparse->n_sightings) number of each in its photo
    ColmapModel *model;
} Build;

// Shared by photos with the same lens. 0 when out of memory.
static uint32_t camera_id(ColmapModel *model, const Lens *lens, FsError *err)
{
    for (int k = 0; k < model->n_cameras; k++)
        if (fs_lens_equal(&model->camera[k].lens, lens)) return model->camera[k].id;
    ColmapCamera *camera = fs_colmap_model_add_camera(model, err);
    if (!camera) return 0;
    camera->lens = *lens;
    return camera->id = (uint32_t)model->n_cameras;
}

// One photo and its sightings, in order of the points' numbers.
static int add_photo(const Build *b, int i, FsError *err)
{
    const Photo *photo = &b->capture->photo[i];
    const Pose *pose = &b->sparse->pose[i];
    double sx = (double)photo->width / photo->picture_width, sy = (double)photo->height / photo->picture_height;
    const Camera *camera = &pose->camera;
    Camera working = fs_camera_resized(camera, photo->width, photo->height);
    Lens lens = b->as_taken ? pose->lens : fs_lens_from_camera(&working);
    FilePath name = fs_file_at("%s.%s", photo->name, b->as_taken ? "png" : "tif");
    ColmapImage *image = fs_colmap_model_add_image(b->model, name.text, err);
    if (!image || !(image->camera_id = camera_id(b->model, &lens, err))) return FS_ERR_MEMORY;
    image->id = (uint32_t)i + 1;
    fs_camera_pose_to_quat(camera->w2c, image->quat, image->t);
    uint32_t n = 0;
    for (int k = 0; k < b->sparse->n_points; k++) {
        const SparsePoint *p = &b->sparse->point[k];
        for (int at = p->first; at < p->first + p->n && p->n >= b->least; at++) {
            const Sighting *s = &b->sparse->sighting[at];
            if (s->photo != i) continue;
            double ray[2] = {(s->x - camera->cx) / camera->fx, (s->y - camera->cy) / camera->fy};
            double pixel[2] = {sx * s->x, sy * s->y};
            if (b->as_taken) fs_lens_project(&pose->lens, ray, pixel);
            MUST(fs_colmap_model_add_observation(b->model, (ColmapObservation){pixel[0], pixel[1], k + 1}, err));
            b->index[at] = n++;
        }
    }
    return 0;
}

int fs_sparse_to_colmap(const Sparse *sparse, const Capture *capture, int least, bool as_taken, ColmapModel *model,
                        FsError *err)
{
    int rc = 0;
    uint32_t *index = calloc((size_t)sparse->n_sightings + 1, sizeof *index);
    const Build build = {sparse, capture, least, as_taken, index, model};
    if (!index) return fs_error_memory(err);
    for (int i = 0; i < capture->n; i++)
        if (sparse->pose[i].known) TRY(add_photo(&build, i, err));
    for (int k = 0; k < sparse->n_points; k++) {
        const SparsePoint *from = &sparse->point[k];
        if (from->n < least) continue;
        ColmapPoint *p = fs_colmap_model_add_point(model, err);
        if (!p) TRY(FS_ERR_MEMORY);
        const Photo *photo = from->n ? &capture->photo[sparse->sighting[from->first].photo] : capture->photo;
        p->id = k + 1;
        p->error = from->error * photo->width / photo->picture_width;
        memcpy(p->xyz, from->xyz, sizeof p->xyz);
        memcpy(p->rgb, from->rgb, sizeof p->rgb);
        for (int at = from->first; at < from->first + from->n; at++)
            TRY(fs_colmap_model_add_track(model, (ColmapTrack){(uint32_t)sparse->sighting[at].photo + 1, index[at]},
                                          err));
    }
fail:
    free(index);
    return rc;
}

static int write_sparse(const Sparse *sparse, const FsProject *project, const Capture *capture, FsError *err)
{
    int rc = 0;
    ColmapModel model = {0};
    TRY(fs_sparse_to_colmap(sparse, capture, 0, false, &model, err));
    TRY(fs_colmap_model_write(fs_file_at("%s/sparse", project->out).text, &model, false, err));
fail:
    fs_colmap_model_free(&model);
    return rc;
}

int fs_sparse_write(const Sparse *sparse, const FsProject *project, const Capture *capture, FsError *err)
{
    MUST(write_photos(sparse, project, capture, err));
    MUST(write_sparse(sparse, project, capture, err));
    return write_views(sparse, project, capture, err);
}

#include "poses/adjust.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"

// COLMAP solves problems of up to 50000 residuals, two an observation, with one thread and so always the same way.
enum { MAX_OBSERVATIONS = 24500, MIN_PER_PHOTO = 200 };

// Shortest track that takes part so that the observations fit.
static int shortest_track(const Sparse *sparse)
{
    for (int least = 3;; least++) {
        int sum = 0;
        for (int k = 0; k < sparse->n_points; k++) sum += sparse->point[k].n >= least ? sparse->point[k].n : 0;
        if (sum <= MAX_OBSERVATIONS) return least;
    }
}

static uint32_t camera_id(ColmapModel *model, const Lens *lens, FsError *err)
{
    for (int k = 0; k < model->n_cameras; k++)
        if (fs_lens_equal(&model->camera[k].lens, lens)) return model->camera[k].id;
    ColmapCamera *camera = fs_colmap_model_add_camera(model, err);
    if (!camera) return 0;
    camera->lens = *lens;
    return camera->id = (uint32_t)model->n_cameras;
}

// One photo and its sightings, where the lens put them. index: per sighting, its number in the photo.
static int add_photo(ColmapModel *model, const Sparse *sparse, const Capture *capture, int i, int least,
                     uint32_t *index, FsError *err)
{
    int rc = 0;
    const Pose *pose = &sparse->pose[i];
    Camera camera;
    TRY(fs_sparse_camera(sparse, i, &camera, err));
    ColmapImage *image = fs_colmap_model_add_image(model, capture->photo[i].picture, err);
    if (!image || !(image->camera_id = camera_id(model, &pose->lens, err))) return FS_ERR_MEMORY;
    image->id = (uint32_t)i + 1;
    fs_camera_pose_to_quat(pose->w2c, image->quat, image->t);
    uint32_t n = 0;
    for (int k = 0; k < sparse->n_points; k++) {
        const SparsePoint *p = &sparse->point[k];
        for (int at = p->first; at < p->first + p->n && p->n >= least; at++) {
            const Sighting *s = &sparse->sighting[at];
            if (s->photo != i) continue;
            double ray[2] = {(s->x - camera.cx) / camera.fx, (s->y - camera.cy) / camera.fy}, pixel[2];
            fs_lens_project(&pose->lens, ray, pixel);
            TRY(fs_colmap_model_add_observation(model, (ColmapObservation){pixel[0], pixel[1], k + 1}, err));
            index[at] = n++;
        }
    }
fail:
    return rc;
}

static int build(ColmapModel *model, const Sparse *sparse, const Capture *capture, FsError *err)
{
    int rc = 0, least = shortest_track(sparse);
    uint32_t *index = calloc((size_t)sparse->n_sightings + 1, sizeof *index);
    if (!index) return fs_error_memory(err);
    for (int i = 0; i < capture->n; i++)
        if (sparse->pose[i].known) TRY(add_photo(model, sparse, capture, i, least, index, err));
    for (int k = 0; k < sparse->n_points; k++) {
        const SparsePoint *from = &sparse->point[k];
        if (from->n < least) continue;
        ColmapPoint *p = fs_colmap_model_add_point(model, err);
        if (!p) {
            rc = FS_ERR_MEMORY;
            goto fail;
        }
        p->id = k + 1;
        memcpy(p->xyz, from->xyz, sizeof p->xyz);
        for (int at = from->first; at < from->first + from->n; at++)
            TRY(fs_colmap_model_add_track(model, (ColmapTrack){(uint32_t)sparse->sighting[at].photo + 1, index[at]},
                                          err));
    }
fail:
    free(index);
    return rc;
}

// Every photo takes part with enough observations; else the adjustment could do harm.
static bool worth_it(const ColmapModel *model)
{
    for (int i = 0; i < model->n_images; i++)
        if (model->image[i].n < MIN_PER_PHOTO) return false;
    return model->n_images > 1;
}

int fs_adjust_poses(Colmap *colmap, Sparse *sparse, FsError *err)
{
    int rc = 0;
    ColmapModel model = {0}, adjusted = {0};
    FsError inner = {0};
    char *from = fs_file_path("%s/before-adjustment", colmap->dir), *to = fs_file_path("%s/adjusted", colmap->dir);
    if (!from || !to) TRY(fs_error_memory(err));
    TRY(build(&model, sparse, colmap->capture, err));
    if (!worth_it(&model)) goto fail;
    TRY(fs_colmap_model_write(from, &model, true, err));
    rc = fs_colmap_adjust(colmap, from, to, &inner);
    if (rc == 0) rc = fs_colmap_model_read(to, &adjusted, &inner);
    if (rc == FS_ERR_INPUT || rc == FS_ERR_IO) { // the poses found before are good enough to go on
        fs_log_warn(&colmap->project->log, "poses: not refined: %s", inner.message);
        rc = 0;
        goto fail;
    }
    if (rc < 0) {
        if (err) *err = inner;
        goto fail;
    }
    if (adjusted.n_images == model.n_images) TRY(fs_sparse_from_colmap(sparse, colmap->capture, &adjusted, false, err));
fail:
    fs_colmap_model_free(&model);
    fs_colmap_model_free(&adjusted);
    free(from);
    free(to);
    return rc;
}

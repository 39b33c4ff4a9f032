#include "poses/sparse.h"

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

// Every photo takes part with enough observations; else the adjustment could do harm.
static bool worth_it(const ColmapModel *model)
{
    for (int i = 0; i < model->n_images; i++)
        if (model->image[i].n < MIN_PER_PHOTO) return false;
    return model->n_images > 1;
}

// All of them, or none where one cannot be used.
static int take_poses(Sparse *sparse, const Capture *capture, const ColmapModel *adjusted, FsError *err)
{
    size_t size = ((size_t)capture->n + 1) * sizeof *sparse->pose;
    Sparse taken = {.pose = malloc(size)};
    if (!taken.pose) return fs_error_memory(err);
    memcpy(taken.pose, sparse->pose, size);
    int rc = fs_sparse_from_colmap(&taken, capture, adjusted, false, err);
    if (rc == 0) memcpy(sparse->pose, taken.pose, size);
    fs_sparse_free(&taken);
    return rc;
}

int fs_adjust_poses(Colmap *colmap, Sparse *sparse, FsError *err)
{
    int rc = 0;
    ColmapModel model = {0}, adjusted = {0};
    FsError inner = {0};
    FilePath from = fs_file_at("%s/before-adjustment", colmap->dir), to = fs_file_at("%s/adjusted", colmap->dir);
    TRY(fs_sparse_to_colmap(sparse, colmap->capture, shortest_track(sparse), true, &model, err));
    if (!worth_it(&model)) goto fail;
    TRY(fs_colmap_model_write(from.text, &model, true, err));
    rc = fs_colmap_adjust(colmap, from.text, to.text, &inner);
    if (rc == 0) rc = fs_colmap_model_read(to.text, &adjusted, &inner);
    if (rc == 0 && adjusted.n_images == model.n_images) rc = take_poses(sparse, colmap->capture, &adjusted, &inner);
    if (rc == FS_ERR_INPUT) // the poses found before are good enough to go on
        fs_log_warn(&colmap->project->log, "poses: not refined: %s", inner.message), rc = 0;
    else if (rc < 0 && err)
        *err = inner;
fail:
    fs_colmap_model_free(&model);
    fs_colmap_model_free(&adjusted);
    return rc;
}

// Describes a camera model: COLMAP folder, transforms.json, views.json, cameras.json.
#include "info/info.h"

#include <stdio.h>

#include "model/cameras_file.h"

#define MAX_CAMERAS_SHOWN 8

static void describe_lens(const Lens *lens, const Log *log)
{
    int n = 0;
    const char *name = fs_lens_model_name(lens->model, &n);
    char text[400] = "";
    size_t used = 0;
    for (int i = 0; i < n && used < sizeof text; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, " %.6g", lens->param[i]);
    fs_log_info(log, "  camera %dx%d %s%s", lens->width, lens->height, name ? name : "of an unknown model", text);
}

static void describe_model(const ColmapModel *model, const Log *log)
{
    for (int i = 0; i < model->n_cameras && i < MAX_CAMERAS_SHOWN; i++) describe_lens(&model->camera[i].lens, log);
    if (model->n_cameras > MAX_CAMERAS_SHOWN)
        fs_log_info(log, "  and %d more cameras", model->n_cameras - MAX_CAMERAS_SHOWN);
    double error = 0;
    for (int i = 0; i < model->n_points; i++) error += model->point[i].error;
    if (model->n_points > 0)
        fs_log_info(log, "  %d points, mean track length %.2f, mean reprojection error %.2f px", model->n_points,
                    (double)model->n_tracks / model->n_points, error / model->n_points);
    else
        fs_log_info(log, "  no points");
}

static void describe_views(const Dataset *views, const Log *log)
{
    int flash = 0, held_out = 0;
    double centre[3], extent = fs_dataset_extent(views, centre);
    for (int i = 0; i < views->n; i++) {
        flash += views->view[i].flash;
        held_out += views->view[i].held_out;
    }
    fs_log_info(log, "  %d views within %.3g units of their centre (%d said to be flash, %d held out)", views->n,
                extent, flash, held_out);
    if (views->n > 0) fs_log_info(log, "  first %s, last %s", views->view[0].name, views->view[views->n - 1].name);
}

int fs_info_cameras(const char *path, const Log *log, FsError *err)
{
    CamerasFile file = {0};
    MUST(fs_cameras_file_read(path, &file, err));
    fs_log_info(log, "%s: %s", path, file.model.n_images > 0 ? "COLMAP model" : "cameras");
    if (file.model.n_images > 0)
        describe_model(&file.model, log);
    else if (file.views.n > 0 && file.lens)
        describe_lens(&file.lens[0], log);
    describe_views(&file.views, log);
    fs_cameras_file_free(&file);
    return 0;
}

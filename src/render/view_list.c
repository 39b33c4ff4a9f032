#include "render/view_list.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/cameras_file.h"

// At the size that a capture with working images of width x height wants.
static Camera fit(const Camera *camera, int width, int height)
{
    double wanted = (double)camera->height * width / camera->width;
    if (fabs(wanted - height) <= 1.0) return fs_camera_resized(camera, width, height); // the same proportions
    return fs_camera_long_edge(camera, width > height ? width : height);
}

#define MAX_SIDE 16384 // of a render; the engine holds some 30 planes of it

static int check_size(const char *file, const View *view, FsError *err)
{
    if (fs_camera_longer_side(&view->camera) <= MAX_SIDE) return 0;
    return fs_error_input(err, "%s: view '%s' would be rendered at %d x %d, at most %d; give --long-edge", file,
                          view->name, view->camera.width, view->camera.height, MAX_SIDE);
}

static int check_names(const char *file, const Dataset *views, FsError *err)
{
    for (int i = 0; i < views->n; i++) {
        const char *name = views->view[i].name;
        if (!*name || *name == '.' || strchr(name, '/') || strlen(name) > 200)
            return fs_error_input(err, "%s: view '%.100s': its name cannot be a file name", file, name);
        if (i && strcmp(name, views->view[i - 1].name) == 0)
            return fs_error_input(err, "%s: two views are named '%s', their renders would be one file", file, name);
    }
    return 0;
}

int fs_view_list_of_photos(const FsProject *project, const Dataset *photos, Dataset *views, FsError *err)
{
    int long_edge = fs_settings_was_set(&project->set, "long-edge") ? project->set.long_edge : 0;
    for (int i = 0; i < photos->n; i++) {
        View view = photos->view[i];
        view.camera = fs_camera_limited(&view.camera, long_edge);
        MUST(fs_dataset_append(views, &view, err));
    }
    return check_names("views.json", views, err);
}

// The size most of the photos have: that of the first one with the longest side.
static const Camera *largest_of(const Dataset *photos)
{
    const Camera *largest = &photos->view[0].camera;
    for (int i = 1; i < photos->n; i++)
        if (fs_camera_longer_side(&photos->view[i].camera) > fs_camera_longer_side(largest))
            largest = &photos->view[i].camera;
    return largest;
}

int fs_view_list_of_model(const FsProject *project, const Dataset *photos, bool own_place, Dataset *views, FsError *err)
{
    const char *path = project->set.cameras;
    CamerasFile file = {0};
    int rc, distorted = 0;
    bool long_edge = fs_settings_was_set(&project->set, "long-edge");
    TRY(fs_cameras_file_read(path, &file, err));
    if (file.views.n == 0) TRY(fs_error_input(err, "%s: no posed views in it, expected at least one", path));
    TRY(check_names(path, &file.views, err));
    TRY(fs_frame_align(&file.views, photos, path, own_place, &project->log, err));
    const Camera *largest = largest_of(photos);
    for (int i = 0; i < file.views.n; i++) {
        Camera *camera = &file.views.view[i].camera;
        *camera = long_edge ? fs_camera_long_edge(camera, project->set.long_edge)
                            : fit(camera, largest->width, largest->height);
        TRY(check_size(path, &file.views.view[i], err));
        distorted += !fs_lens_is_pinhole(&file.lens[i]);
    }
    if (distorted)
        fs_log_warn(&project->log, "%s: %d of %d cameras have lens distortion; rendered without it", path, distorted,
                    file.views.n);
    *views = file.views;
    file.views = (Dataset){0};
fail:
    fs_cameras_file_free(&file);
    return rc;
}

int fs_view_list_of_spiral(const FsProject *project, const Dataset *photos, double nearest, double farthest,
                           Dataset *views, FsError *err)
{
    int rc = 0, n = project->set.path_views;
    int long_edge = fs_settings_was_set(&project->set, "long-edge") ? project->set.long_edge : 0;
    Spiral spiral;
    Camera *cameras = malloc(sizeof *cameras * (size_t)(photos->n ? photos->n : 1));
    if (!cameras) return fs_error_memory(err);
    for (int i = 0; i < photos->n; i++) cameras[i] = photos->view[i].camera;
    TRY(fs_spiral_fit(&spiral, cameras, photos->n, nearest, farthest, err));
    Camera like = fs_camera_long_edge(&cameras[0], long_edge);
    for (int i = 0; i < n; i++) {
        char name[32];
        snprintf(name, sizeof name, "path_%04d", i + 1);
        View view = {.name = name, .camera = fs_spiral_camera(&spiral, &like, i, n)};
        TRY(fs_dataset_append(views, &view, err));
    }
fail:
    free(cameras);
    return rc;
}

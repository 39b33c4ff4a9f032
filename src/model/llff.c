#include "model/llff.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/photo.h"

enum { LEAST_VALUES = 15, MOST_VALUES = 17, MOST_ROWS = 100000 };

// Names of the photos in a folder, sorted; how many.
static int list_photos(const char *folder, FileList *list)
{
    if (fs_file_list(folder, list, NULL) < 0) return 0;
    int kept = 0;
    for (int i = 0; i < list->n; i++) {
        if (fs_photo_kind(list->name[i]) >= 0)
            list->name[kept++] = list->name[i];
        else
            free(list->name[i]);
    }
    return list->n = kept;
}

// The photos that n rows are of: those of images, or of another folder whose name begins so.
static int find_names(const char *path, int n, FileList *names, FsError *err)
{
    FilePath beside = fs_file_at("%.*s", (int)(fs_file_name(path) - path), path);
    const char *dir = *beside.text ? beside.text : ".";
    int found = list_photos(fs_file_at("%s/images", dir).text, names), first = found;
    FileList folders = {0};
    if (found != n && fs_file_list(dir, &folders, NULL) < 0) folders.n = 0;
    for (int i = 0; i < folders.n && found != n; i++) {
        if (strncmp(folders.name[i], "images", 6) != 0) continue;
        fs_file_list_free(names);
        found = list_photos(fs_file_at("%s/%s", dir, folders.name[i]).text, names);
        if (first == 0) first = found;
    }
    fs_file_list_free(&folders);
    if (found == n) return 0;
    return fs_error_input(err, "%s: of %d photos, but the folder images beside it holds %d: expected the same photos",
                          path, n, first);
}

static int read_row(const char *path, const NpyArray *a, size_t row, PosedView *view, FsError *err)
{
    double p[LEAST_VALUES], axes[12] = {0}, centre[3];
    for (size_t i = 0; i < LEAST_VALUES; i++) {
        p[i] = fs_npy_value(a, a->data + row * a->stride[0] + i * a->stride[1]);
        if (!(fabs(p[i]) < 1e15)) return fs_error_input(err, "%s: row %zu: not a finite number", path, row);
    }
    const double height = p[4], width = p[9], focal = p[14];
    if (!(height >= 1 && width >= 1 && height <= FS_IMAGE_MAX_SIDE && width <= FS_IMAGE_MAX_SIDE && focal > 0))
        return fs_error_input(err, "%s: row %zu: a photo of %g x %g pixels and a focal length of %g", path, row, width,
                              height, focal);
    for (int k = 0; k < 3; k++) { // of camera-to-world: down, right, backward, place
        axes[k] = p[5 * k + 1];
        axes[4 + k] = p[5 * k];
        axes[8 + k] = -p[5 * k + 2];
        centre[k] = p[5 * k + 3];
    }
    if (!fs_camera_is_rotation(axes, 1e-2)) return fs_error_input(err, "%s: row %zu: not a rotation", path, row);
    fs_camera_pose_from_axes(axes, centre, view->w2c);
    int w = (int)lround(width), h = (int)lround(height);
    view->lens = (Lens){.model = LENS_PINHOLE, .width = w, .height = h, .param = {focal, focal, 0.5 * w, 0.5 * h}};
    return 0;
}

int fs_llff_read(const char *path, PosedView **view, int *n, FsError *err)
{
    NpyArray a;
    FileList names = {0};
    *view = NULL;
    *n = 0;
    int rc = fs_npy_read(path, &a, err);
    if (rc < 0) return rc;
    if (a.n_dims != 2 || a.dim[1] < LEAST_VALUES || a.dim[1] > MOST_VALUES || a.dim[0] > MOST_ROWS)
        TRY(fs_error_input(err, "%s: expected LLFF's poses: a row of %d numbers a photo", path, MOST_VALUES));
    TRY(find_names(path, (int)a.dim[0], &names, err));
    *view = calloc(a.dim[0], sizeof **view);
    if (!*view) TRY(fs_error_memory(err));
    *n = (int)a.dim[0];
    for (int i = 0; i < *n; i++) {
        if (!((*view)[i].name = fs_file_stem(names.name[i]))) TRY(fs_error_memory(err));
        TRY(read_row(path, &a, (size_t)i, &(*view)[i], err));
    }
fail:
    fs_file_list_free(&names);
    fs_npy_free(&a);
    return rc;
}

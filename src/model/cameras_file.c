#include "model/cameras_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/order.h"
#include "model/llff.h"
#include "model/photos.h"

#define MAX_FRAMES 1000000

void fs_cameras_file_free(CamerasFile *file)
{
    fs_dataset_free(&file->views);
    fs_colmap_model_free(&file->model);
    free(file->lens);
    free(file->image);
    *file = (CamerasFile){0};
}

// "flash/P_1.JPG" and "noflash/P_1.JPG" are flash_P_1 and noflash_P_1, as such photos are (photos.h).
static int add_folder(PosedView *posed, FsError *err)
{
    const char *path = posed->path + (strncmp(posed->path, "./", 2) == 0 ? 2 : 0), *dot = strrchr(path, '.');
    bool has_extension = dot && dot > path && !strpbrk(dot, "/\\");
    char *whole = strndup(path, has_extension ? (size_t)(dot - path) : strlen(path));
    char *name = whole ? fs_photos_view_name(whole) : NULL;
    free(whole);
    if (!name) return fs_error_memory(err);
    free(posed->name);
    posed->name = name;
    return 0;
}

// In order, and where names repeat with their folders before them.
static int name_apart(PosedView *posed, int n, FsError *err)
{
    bool apart = true;
    fs_order_named(posed, (size_t)n, sizeof *posed);
    for (int i = 1; i < n; i++) apart &= strcmp(posed[i - 1].name, posed[i].name) != 0;
    for (int i = 0; i < n && !apart; i++)
        if (posed[i].path) MUST(add_folder(&posed[i], err));
    if (!apart) fs_order_named(posed, (size_t)n, sizeof *posed);
    return 0;
}

// Fills views and lens from posed views in any order.
static int take_posed(CamerasFile *file, const char *path, PosedView *posed, int n, FsError *err)
{
    MUST(name_apart(posed, n, err));
    file->lens = malloc(((size_t)n + 1) * sizeof *file->lens);
    file->image = malloc(((size_t)n + 1) * sizeof *file->image);
    if (!file->lens || !file->image) return fs_error_memory(err);
    for (int i = 0; i < n; i++) {
        View view = {.name = posed[i].name};
        MUST(fs_lens_camera(&posed[i].lens, path, &view.camera, err));
        memcpy(view.camera.w2c, posed[i].w2c, sizeof view.camera.w2c);
        MUST(fs_error_about(fs_dataset_append(&file->views, &view, err), path, err));
        file->lens[i] = posed[i].lens;
        file->image[i] = posed[i].image;
    }
    return 0;
}

static void free_posed(PosedView *posed, int n)
{
    for (int i = 0; i < n && posed; i++) free(posed[i].name);
    free(posed);
}

// Without the folder, be it written as Windows does.
static const char *name_of(const char *path)
{
    const char *windows = strrchr(path, '\\');
    return fs_file_name(windows ? windows + 1 : path);
}

// As a photo of that name has it (photos.h). NULL: out of memory.
static char *view_name(const char *path)
{
    char *stem = fs_file_stem(name_of(path)), *name = stem ? fs_photos_view_name(stem) : NULL;
    free(stem);
    return name;
}

static int read_colmap(const char *path, CamerasFile *file, FsError *err)
{
    int rc = 0;
    PosedView *posed = NULL;
    TRY(fs_colmap_model_read(path, &file->model, err));
    posed = calloc((size_t)file->model.n_images, sizeof *posed);
    if (!posed) return fs_error_memory(err);
    for (int i = 0; i < file->model.n_images; i++) {
        const ColmapImage *image = &file->model.image[i];
        fs_camera_pose_from_quat(image->quat, image->t, posed[i].w2c);
        posed[i].lens = fs_colmap_model_camera(&file->model, image->camera_id)->lens;
        posed[i].image = i;
        posed[i].path = image->name;
        if (!(posed[i].name = view_name(image->name))) TRY(fs_error_memory(err));
    }
    TRY(take_posed(file, path, posed, file->model.n_images, err));
fail:
    free_posed(posed, file->model.n_images);
    return rc;
}

// A number of the frame, or of the file where the frame has none.
static bool number(const json_t *root, const json_t *frame, const char *key, double *value)
{
    const json_t *v = json_object_get(frame, key);
    if (!v) v = json_object_get(root, key);
    if (!json_is_number(v)) return false;
    *value = json_number_value(v);
    return isfinite(*value);
}

static const char *lens_from_json(const json_t *root, const json_t *frame, Lens *lens)
{
    double w, h, fx, fy, angle;
    if (!number(root, frame, "w", &w) || !number(root, frame, "h", &h) || w < 1 || h < 1 || w > FS_IMAGE_MAX_SIDE ||
        h > FS_IMAGE_MAX_SIDE)
        return "image size \"w\" and \"h\"";
    if (!number(root, frame, "fl_x", &fx)) {
        if (!number(root, frame, "camera_angle_x", &angle) || !(angle > 0 && angle < 3.1))
            return "focal length \"fl_x\" or \"camera_angle_x\"";
        fx = 0.5 * w / tan(0.5 * angle);
    }
    if (!number(root, frame, "fl_y", &fy)) fy = fx;
    *lens = (Lens){.model = LENS_OPENCV, .width = (int)w, .height = (int)h, .param = {fx, fy, 0.5 * w, 0.5 * h}};
    double *p = lens->param;
    number(root, frame, "cx", &p[2]);
    number(root, frame, "cy", &p[3]);
    const json_t *model = json_object_get(frame, "camera_model");
    const char *name = json_string_value(model ? model : json_object_get(root, "camera_model"));
    double k[6] = {0}, q[2] = {0};
    static const char *const keys[6] = {"k1", "k2", "k3", "k4", "k5", "k6"};
    for (int i = 0; i < 6; i++) number(root, frame, keys[i], &k[i]);
    number(root, frame, "p1", &q[0]);
    number(root, frame, "p2", &q[1]);
    bool fisheye = json_is_true(json_object_get(root, "is_fisheye")); // instant-ngp's
    if (name ? strcmp(name, "OPENCV_FISHEYE") == 0 : fisheye) {
        lens->model = LENS_OPENCV_FISHEYE;
        memcpy(p + 4, k, 4 * sizeof *k);
        return NULL;
    }
    if (name && fs_lens_model_find(name) < 0) return "a \"camera_model\" that COLMAP knows";
    int known = name ? fs_lens_model_find(name) : LENS_OPENCV;
    if (known > LENS_OPENCV && known != LENS_FULL_OPENCV) return "\"camera_model\" PINHOLE, OPENCV or OPENCV_FISHEYE";
    if (known != LENS_FULL_OPENCV && k[3] != 0 && k[4] == 0 && k[5] == 0)
        return "\"k4\" 0: nerfstudio's fourth coefficient, of r^8, is not known here; undistort the photos";
    double distortion[8] = {k[0], k[1], q[0], q[1], k[2], k[3], k[4], k[5]};
    if (k[2] != 0 || k[3] != 0 || k[4] != 0 || k[5] != 0) lens->model = LENS_FULL_OPENCV;
    if (known == LENS_PINHOLE || known == LENS_SIMPLE_PINHOLE)
        lens->model = LENS_PINHOLE;
    else
        memcpy(p + 4, distortion, sizeof distortion);
    return NULL;
}

// "transform_matrix": camera-to-world, OpenGL axes (x right, y up, z backward) -> world-to-camera, COLMAP axes.
static const char *pose_from_json(const json_t *frame, double w2c[12])
{
    double m[12], axes[12] = {0}, centre[3];
    if (!fs_json_file_matrix(json_object_get(frame, "transform_matrix"), m))
        return "\"transform_matrix\" of 4x4 numbers";
    if (!fs_camera_is_rotation(m, 1e-2)) return "a right-handed rotation in \"transform_matrix\"";
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) axes[4 * j + i] = j == 0 ? m[4 * i + j] : -m[4 * i + j];
        centre[i] = m[4 * i + 3];
    }
    fs_camera_pose_from_axes(axes, centre, w2c);
    return NULL;
}

static int read_transforms(const char *path, const json_t *root, CamerasFile *file, FsError *err)
{
    const json_t *frames = json_object_get(root, "frames");
    size_t n = json_array_size(frames);
    if (n < 1 || n > MAX_FRAMES) return fs_error_input(err, "%s: expected a list \"frames\"", path);
    PosedView *posed = calloc(n, sizeof *posed);
    if (!posed) return fs_error_memory(err);
    int rc = 0;
    for (size_t i = 0; i < n; i++) {
        const json_t *frame = json_array_get(frames, i);
        const char *name = json_string_value(json_object_get(frame, "file_path"));
        const char *wanted = name && *name_of(name) ? NULL : "\"file_path\"";
        if (!wanted) wanted = lens_from_json(root, frame, &posed[i].lens);
        if (!wanted) wanted = pose_from_json(frame, posed[i].w2c);
        if (wanted) TRY(fs_error_input(err, "%s: frame %zu: expected %s", path, i, wanted));
        posed[i].path = name;
        if (!(posed[i].name = view_name(name))) TRY(fs_error_memory(err));
    }
    TRY(take_posed(file, path, posed, (int)n, err));
fail:
    free_posed(posed, (int)n);
    return rc;
}

static int read_llff(const char *path, CamerasFile *file, FsError *err)
{
    int n, rc;
    PosedView *posed;
    TRY(fs_llff_read(path, &posed, &n, err));
    TRY(take_posed(file, path, posed, n, err));
fail:
    free_posed(posed, n);
    return rc;
}

static int read_json(const char *path, CamerasFile *file, FsError *err)
{
    int rc = 0;
    json_t *root;
    TRY(fs_json_file_read(path, (size_t)1 << 30, &root, err));
    if (json_object_get(root, "frames")) {
        TRY(read_transforms(path, root, file, err));
    } else {
        TRY(fs_dataset_read(&file->views, path, err));
        file->lens = malloc(((size_t)file->views.n + 1) * sizeof *file->lens);
        if (!file->lens) TRY(fs_error_memory(err));
        for (int i = 0; i < file->views.n; i++) file->lens[i] = fs_lens_from_camera(&file->views.view[i].camera);
    }
fail:
    json_decref(root);
    return rc;
}

int fs_cameras_file_read(const char *path, CamerasFile *file, FsError *err)
{
    *file = (CamerasFile){0};
    int rc = 0;
    char *model = NULL;
    FilePath transforms = fs_file_at("%s/transforms.json", path), bounds = fs_file_at("%s/poses_bounds.npy", path);
    if (!fs_file_exists(path)) {
        rc = fs_error_input(
            err, "%s: no such file or folder; expected a COLMAP model, a transforms.json or a poses_bounds.npy", path);
    } else if (!fs_file_is_dir(path)) {
        rc = fs_file_has_ext(path, "npy") ? read_llff(path, file, err) : read_json(path, file, err);
    } else if ((model = fs_colmap_model_find(path))) {
        rc = read_colmap(model, file, err);
    } else if (fs_file_exists(transforms.text)) {
        rc = read_json(transforms.text, file, err);
    } else if (fs_file_exists(bounds.text)) {
        rc = read_llff(bounds.text, file, err);
    } else {
        rc = fs_error_input(err,
                            "%s: holds no COLMAP model (cameras.bin or .txt, images.bin or .txt), no transforms.json "
                            "and no poses_bounds.npy",
                            path);
    }
    free(model);
    if (rc < 0) fs_cameras_file_free(file);
    return rc;
}

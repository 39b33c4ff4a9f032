#include "model/dataset.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/memory.h"
#include "image/tone.h"
#include "model/project.h"

#define MAX_VIEWS 1000000
#define MOST_LIFT 16 // 4 stops

void fs_dataset_free(Dataset *dataset)
{
    for (int i = 0; i < dataset->n; i++) free(dataset->view[i].name);
    free(dataset->view);
    *dataset = (Dataset){0};
}

// Place of name in the sorted views: the first that is not before it.
static int lower_bound(const Dataset *dataset, const char *name)
{
    int lo = 0, hi = dataset->n;
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (strcmp(dataset->view[mid].name, name) < 0)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

static int find_exact(const Dataset *dataset, const char *name)
{
    int at = lower_bound(dataset, name);
    return at < dataset->n && strcmp(dataset->view[at].name, name) == 0 ? at : -1;
}

int fs_dataset_append(Dataset *dataset, const View *view, FsError *err)
{
    int at = lower_bound(dataset, view->name);
    if (find_exact(dataset, view->name) >= 0)
        return fs_error_input(err, "%s: two views have this name; names must differ without folder and extension",
                              view->name);
    if (fs_memory_grow(&dataset->view, dataset->n, sizeof *dataset->view, err) < 0) return FS_ERR_MEMORY;
    char *name = strdup(view->name);
    if (!name) return fs_error_memory(err);
    memmove(dataset->view + at + 1, dataset->view + at, (size_t)(dataset->n - at) * sizeof *dataset->view);
    dataset->view[at] = *view;
    dataset->view[at].name = name;
    dataset->n++;
    return 0;
}

int fs_dataset_find(const Dataset *dataset, const char *name)
{
    int at = find_exact(dataset, name); // a stored name is a stem already, and may hold a dot
    char *stem = at < 0 ? fs_file_stem(name) : NULL;
    if (stem) at = find_exact(dataset, stem);
    free(stem);
    return at;
}

double fs_dataset_extent(const Dataset *dataset, double centre[3])
{
    const Camera *first = dataset->n ? &dataset->view->camera : NULL;
    return fs_camera_extent(first, sizeof *dataset->view, dataset->n, centre);
}

double fs_dataset_lift(Dataset *dataset, double brightness)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < dataset->n; i++) {
        const View *view = &dataset->view[i];
        if (!fs_dataset_trains(view) || view->brightness <= 0) continue;
        sum += view->brightness;
        n++;
    }
    if (n == 0 || brightness <= 0) return 1;
    double lift = fmin(fmax((double)fs_tone_decode((float)(brightness * n / sum)), 1), MOST_LIFT);
    for (int i = 0; i < dataset->n; i++) {
        View *view = &dataset->view[i];
        view->lift = lift;
        view->exposure_gain = (view->exposure_gain > 0 ? view->exposure_gain : 1) * lift;
    }
    return lift;
}

int fs_dataset_leave_blurred(Dataset *dataset, double least)
{
    int all[2] = {0, 0}, found[2] = {0, 0}, left = 0;
    for (int i = 0; i < dataset->n; i++) {
        View *view = &dataset->view[i];
        view->blurred = !view->held_out && view->sharpness > 0 && view->sharpness < least;
        all[view->flash] += !view->held_out;
        found[view->flash] += view->blurred;
    }
    for (int i = 0; i < dataset->n; i++) {
        View *view = &dataset->view[i];
        view->blurred = view->blurred && 4 * found[view->flash] < all[view->flash];
        left += view->blurred;
    }
    return left;
}

static json_t *lens_to_json(const Lens *lens)
{
    int n = 0;
    const char *model = fs_lens_model_name(lens->model, &n);
    json_t *params = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(params, json_real(lens->param[i]));
    return json_pack("{s:s, s:i, s:i, s:o}", "model", model, "width", lens->width, "height", lens->height, "params",
                     params);
}

static json_t *view_to_json(const View *view)
{
    const Camera *c = &view->camera;
    json_t *rows = json_array();
    for (int i = 0; i < 3; i++)
        json_array_append_new(
            rows, json_pack("[ffff]", c->w2c[4 * i], c->w2c[4 * i + 1], c->w2c[4 * i + 2], c->w2c[4 * i + 3]));
    json_array_append_new(rows, json_pack("[ffff]", 0.0, 0.0, 0.0, 1.0));
    return json_pack("{s:s, s:b, s:b, s:b, s:f, s:f, s:f, s:f, s:i, s:i, s:f, s:f, s:f, s:f, s:o, s:o*}", "name",
                     view->name, "flash", view->flash, "held_out", view->held_out, "encoded", view->encoded,
                     "flash_gain", view->flash_gain, "exposure_gain", view->exposure_gain, "brightness",
                     view->brightness, "sharpness", view->sharpness, "width", c->width, "height", c->height, "fx",
                     c->fx, "fy", c->fy, "cx", c->cx, "cy", c->cy, "w2c", rows, "lens",
                     view->distorted ? lens_to_json(&view->lens) : NULL);
}

int fs_dataset_write(const Dataset *dataset, const char *path, FsError *err)
{
    json_t *views = json_array();
    bool ok = views;
    for (int i = 0; i < dataset->n && ok; i++) ok = json_array_append_new(views, view_to_json(&dataset->view[i])) == 0;
    json_t *root = json_pack("{s:o}", "views", views);
    if (ok && root) return fs_json_file_write(path, root, JSON_INDENT(1) | JSON_REAL_PRECISION(17), err);
    json_decref(root);
    return fs_error_set(err, FS_ERR_IO, "%s: cannot write: a camera is not finite or memory is out", path);
}

static bool get_number(const json_t *object, const char *key, double *value)
{
    const json_t *v = json_object_get(object, key);
    if (!json_is_number(v)) return false;
    *value = json_number_value(v);
    return isfinite(*value);
}

static const char *camera_from_json(const json_t *object, Camera *c)
{
    double w = 0, h = 0;
    if (!get_number(object, "width", &w) || !get_number(object, "height", &h) || w < 1 || h < 1 ||
        w > FS_IMAGE_MAX_SIDE || h > FS_IMAGE_MAX_SIDE)
        return "\"width\" and \"height\" from 1 to 65535";
    c->width = (int)w;
    c->height = (int)h;
    if (!get_number(object, "fx", &c->fx) || !get_number(object, "fy", &c->fy) || !(c->fx > 0) || !(c->fy > 0))
        return "positive \"fx\" and \"fy\"";
    if (!get_number(object, "cx", &c->cx) || !get_number(object, "cy", &c->cy)) return "\"cx\" and \"cy\"";
    if (!fs_json_file_matrix(json_object_get(object, "w2c"), c->w2c)) return "\"w2c\" of 4x4 numbers";
    return fs_camera_is_rotation(c->w2c, 1e-3) ? NULL : "a rotation in \"w2c\"";
}

// NULL, or what is wrong.
static const char *lens_from_json(const json_t *object, Lens *lens)
{
    int n = 0;
    double w, h;
    Camera camera;
    const char *name = json_string_value(json_object_get(object, "model"));
    const json_t *params = json_object_get(object, "params");
    lens->model = name ? fs_lens_model_find(name) : -1;
    if (!fs_lens_model_name(lens->model, &n) || (int)json_array_size(params) != n || !get_number(object, "width", &w) ||
        !get_number(object, "height", &h) || w < 1 || h < 1 || w > FS_IMAGE_MAX_SIDE || h > FS_IMAGE_MAX_SIDE)
        return "a \"lens\" of \"model\", \"width\", \"height\" and the model's \"params\"";
    lens->width = (int)w, lens->height = (int)h;
    for (int i = 0; i < n; i++) lens->param[i] = json_number_value(json_array_get(params, (size_t)i));
    return fs_lens_camera(lens, "", &camera, NULL) < 0 ? "a \"lens\" that a photo can be taken with" : NULL;
}

static int read_view(Dataset *dataset, const json_t *object, size_t index, const char *path, FsError *err)
{
    View view = {0};
    const char *name = json_string_value(json_object_get(object, "name"));
    if (!name || !*name || strchr(name, '/'))
        return fs_error_input(err, "%s: view %zu: expected a \"name\" without folder", path, index);
    view.name = (char *)name;
    view.flash = json_is_true(json_object_get(object, "flash"));
    view.held_out = json_is_true(json_object_get(object, "held_out"));
    if (!get_number(object, "flash_gain", &view.flash_gain) || !(view.flash_gain > 1e-3 && view.flash_gain < 1e3))
        view.flash_gain = 0;
    if (!get_number(object, "exposure_gain", &view.exposure_gain) ||
        !(view.exposure_gain > 1e-3 && view.exposure_gain < 1e3))
        view.exposure_gain = 0;
    if (!get_number(object, "brightness", &view.brightness) || !(view.brightness > 0)) view.brightness = 0;
    if (!get_number(object, "sharpness", &view.sharpness) || !(view.sharpness > 0)) view.sharpness = 0;
    view.encoded = json_is_true(json_object_get(object, "encoded"));
    const char *wanted = camera_from_json(object, &view.camera);
    const json_t *lens = json_object_get(object, "lens");
    view.distorted = lens != NULL;
    if (!wanted && lens) wanted = lens_from_json(lens, &view.lens);
    if (wanted) return fs_error_input(err, "%s: view '%s': expected %s", path, name, wanted);
    return fs_error_about(fs_dataset_append(dataset, &view, err), path, err);
}

int fs_dataset_read(Dataset *dataset, const char *path, FsError *err)
{
    *dataset = (Dataset){0};
    json_t *root = NULL;
    int rc = 0;
    if (!fs_file_exists(path))
        TRY(fs_error_input(
            err,
            "%s: is not there: `flashsplat poses OUT` makes views.json (--force: again), and a truth has cameras.json",
            path));
    rc = fs_json_file_read(path, (size_t)1 << 30, &root, err);
    if (strcmp(fs_file_name(path), "views.json") == 0)
        rc = fs_error_then(rc, "remove it, and `flashsplat poses OUT --force` makes it again", err);
    TRY(rc);
    const json_t *views = json_object_get(root, "views");
    if (!views) views = json_object_get(root, "images");
    if (!json_is_array(views) || json_array_size(views) > MAX_VIEWS)
        TRY(fs_error_input(err, "%s: expected a list \"views\" or \"images\" of cameras", path));
    for (size_t i = 0; i < json_array_size(views); i++) TRY(read_view(dataset, json_array_get(views, i), i, path, err));
fail:
    if (rc < 0) fs_dataset_free(dataset);
    json_decref(root);
    return rc;
}

static int check_picture(const char *path, const Image *image, int channels, const View *view, FsError *err)
{
    if (image->width != view->camera.width || image->height != view->camera.height)
        return fs_error_input(err,
                              "%s: %d x %d pixels, but views.json says %d x %d; rerun the stage poses with --force",
                              path, image->width, image->height, view->camera.width, view->camera.height);
    if (image->channels == channels) return 0;
    return fs_error_input(err, "%s: %d channels, expected %d%s", path, image->channels, channels,
                          channels == 1 ? " (grey)" : "");
}

// A damaged picture, with what to do.
static int again(const char *out, int rc, const FsError *why, FsError *err)
{
    if (rc == FS_ERR_INPUT)
        return fs_error_input(err,
                              "%s; remove it (and that of its name in %s/linear, where it is damaged, too), and "
                              "`flashsplat ingest PHOTOS -o %s --force` and `flashsplat poses %s --force` make it again",
                              why->message, out, out, out);
    if (rc < 0 && err) *err = *why;
    return rc;
}

int fs_dataset_load_view(const char *out, const View *view, Image *photo, Image *mask, FsError *err)
{
    int rc = 0;
    FsError why = {0};
    FilePath path = fs_file_at("%s/images/%s.tif", out, view->name);
    for (int i = 0; i < 1 + (mask != NULL); i++) {
        FilePath name = fs_file_at("images/%s%s", view->name, i ? "_mask.png" : ".tif");
        if (!fs_file_exists(fs_file_at("%s/%s", out, name.text).text))
            TRY(fs_project_missing(out, FS_STAGE_POSES, name.text, err));
    }
    TRY(again(out, fs_tiff_read(path.text, photo, &why), &why, err));
    TRY(check_picture(path.text, photo, 3, view, err));
    for (size_t i = 0; view->lift > 0 && i < fs_image_values(photo); i++) photo->px[i] *= (float)view->lift;
    path = fs_file_at("%s/images/%s_mask.png", out, view->name);
    if (mask) TRY(again(out, fs_png_read(path.text, mask, &why), &why, err));
    if (mask) TRY(check_picture(path.text, mask, 1, view, err));
fail:
    if (rc < 0) fs_image_free(photo);
    if (rc < 0 && mask) fs_image_free(mask);
    return rc;
}

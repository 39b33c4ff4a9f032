// Layers as 8-bit PNG in the encoding of the layer PNGs; depth in millimetres and reflectance as 16-bit PNG.
#include "synth/truth_files.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/tone.h"
#include "model/colmap_model.h"

static json_t *matrix_json(const double w2c[12])
{
    static const double last[4] = {0, 0, 0, 1};
    json_t *rows = json_array();
    for (int i = 0; i < 4; i++) {
        json_t *row = json_array();
        for (int j = 0; j < 4; j++) json_array_append_new(row, json_real(i < 3 ? w2c[4 * i + j] : last[j]));
        json_array_append_new(rows, row);
    }
    return rows;
}

static json_t *shot_json(const Shot *s)
{
    char file[24];
    snprintf(file, sizeof file, "%s.DNG", s->name);
    json_t *o = json_object();
    json_object_set_new(o, "name", json_string(s->name));
    json_object_set_new(o, "file", s->held_out ? json_null() : json_string(file));
    json_object_set_new(o, "flash", s->held_out ? json_null() : json_boolean(s->flash));
    json_object_set_new(o, "held_out", json_boolean(s->held_out));
    json_object_set_new(o, "width", json_integer(s->camera.width));
    json_object_set_new(o, "height", json_integer(s->camera.height));
    json_object_set_new(o, "fx", json_real(s->camera.fx));
    json_object_set_new(o, "fy", json_real(s->camera.fy));
    json_object_set_new(o, "cx", json_real(s->camera.cx));
    json_object_set_new(o, "cy", json_real(s->camera.cy));
    json_object_set_new(o, "w2c", matrix_json(s->camera.w2c));
    json_object_set_new(o, "truth", json_boolean(s->truth));
    return o;
}

static int write_json(const char *dir, const char *scene, const Shot *shot, int n, FsError *err)
{
    json_t *root = json_object(), *images = json_array();
    json_object_set_new(root, "scene", json_string(scene));
    json_object_set_new(root, "note",
                        json_string("w2c: world-to-camera, COLMAP axes (x right, y down, z forward), metres; "
                                    "pixel centres at +0.5"));
    for (int i = 0; i < n; i++) json_array_append_new(images, shot_json(&shot[i]));
    json_object_set_new(root, "images", images);
    char *text = json_dumps(root, JSON_INDENT(1)), *path = fs_file_path("%s/cameras.json", dir);
    int rc = text && path ? fs_file_write(path, text, strlen(text), err) : fs_error_memory(err);
    free(text);
    free(path);
    json_decref(root);
    return rc;
}

static int write_sparse(const char *dir, const Shot *shot, int n, const Spec *spec, FsError *err)
{
    int rc = 0;
    ColmapModel model = {0};
    char *path = fs_file_path("%s/sparse", dir);
    if (!path) return fs_error_memory(err);
    TRY(fs_file_mkdirs(path, err));
    Rng rng = fs_rng_new(spec->seed * 53ull + 11);
    for (int i = 0; i < n; i++) {
        char name[24];
        snprintf(name, sizeof name, "%s.JPG", shot[i].name);
        Camera camera = spec->pose_noise ? fs_path_disturbed(&shot[i].camera, &rng) : shot[i].camera;
        if (i == 0) {
            ColmapCamera *c = fs_colmap_model_add_camera(&model, err);
            if (!c) goto memory;
            *c = (ColmapCamera){1, fs_lens_from_camera(&camera)};
        }
        ColmapImage *image = fs_colmap_model_add_image(&model, name, err);
        if (!image) goto memory;
        double r[9];
        for (int k = 0; k < 9; k++) r[k] = camera.w2c[4 * (k / 3) + k % 3];
        image->id = (uint32_t)i + 1;
        image->camera_id = 1;
        fs_camera_rotation_to_quat(r, image->quat);
        for (int k = 0; k < 3; k++) image->t[k] = camera.w2c[4 * k + 3];
    }
    TRY(fs_colmap_model_write(path, &model, false, err));
    goto done;
memory:
    rc = fs_error_memory(err);
fail:
done:
    fs_colmap_model_free(&model);
    free(path);
    return rc;
}

int fs_truth_files_cameras(const char *dir, const char *scene, const Shot *shot, int n, const Spec *spec, FsError *err)
{
    int rc;
    TRY(write_json(dir, scene, shot, n, err));
    TRY(write_sparse(dir, shot, n, spec, err));
fail:
    return rc;
}

static const char *const folders[] = {"T_N", "T_F", "R", "I_N", "I_F", "depth_T", "beta"};

int fs_truth_files_folders(const char *dir, FsError *err)
{
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        char *path = fs_file_path("%s/%s", dir, folders[i]);
        int rc = path ? fs_file_mkdirs(path, err) : fs_error_memory(err);
        free(path);
        if (rc < 0) return rc;
    }
    return 0;
}

// Writes a + b (b may be NULL), coded; scale: for maps that are not colours, which stay linear.
static int write_png(const char *dir, const char *layer, const char *name, const Image *a, const Image *b, float scale,
                     FsError *err)
{
    Image image = {0};
    char *path = fs_file_path("%s/%s/%s.png", dir, layer, name);
    int rc = path ? fs_image_copy(&image, a, err) : fs_error_memory(err);
    if (rc == 0) {
        size_t n = (size_t)image.width * (size_t)image.height * (size_t)image.channels;
        for (size_t i = 0; i < n; i++) image.px[i] = (image.px[i] + (b ? b->px[i] : 0.0f)) * scale;
        bool color = image.channels == 3;
        if (color) fs_tone_encode_image(&image);
        rc = fs_png_write(path, &image, color ? 8 : 16, err);
    }
    fs_image_free(&image);
    free(path);
    return rc;
}

int fs_truth_files_layers(const char *dir, const Shot *shot, const Traced *traced, FsError *err)
{
    int rc;
    const Image *l = traced->layer;
    TRY(write_png(dir, "T_N", shot->name, &l[TRACE_T_N], NULL, 1, err));
    TRY(write_png(dir, "T_F", shot->name, &l[TRACE_T_F], NULL, 1, err));
    TRY(write_png(dir, "R", shot->name, &l[TRACE_R_N], NULL, 1, err));
    if (shot->held_out) {
        TRY(write_png(dir, "I_N", shot->name, &l[TRACE_T_N], &l[TRACE_R_N], 1, err));
        TRY(write_png(dir, "I_F", shot->name, &l[TRACE_T_F], &l[TRACE_R_F], 1, err));
    }
fail:
    return rc;
}

int fs_truth_files_geometry(const char *dir, const Shot *shot, const Image *depth, const Image *beta, FsError *err)
{
    int rc;
    TRY(write_png(dir, "depth_T", shot->name, depth, NULL, 1000.0f / 65535.0f, err));
    TRY(write_png(dir, "beta", shot->name, beta, NULL, 1, err));
fail:
    return rc;
}

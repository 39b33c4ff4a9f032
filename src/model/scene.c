// Scenes on disk: <layer>.ply per cloud that is not empty, and model.json with the rest, written last.
#include "model/scene.h"

#include <math.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "image/tone.h"
#include "model/project.h"

#define VERSION 2             // 1: flash_return was a constant factor on R
#define MAX_PHOTOS (64 << 20) // bytes of photos.json

const char *const fs_scene_separations[SEPARATIONS] = {"full", "flashless", "linear", "none"};

int fs_scene_photos(const char *out, json_t **photos, FsError *err)
{
    FilePath path = fs_file_at("%s/clouds/photos.json", out);
    FsError why = {0};
    *photos = NULL;
    if (!fs_file_exists(path.text) || fs_json_file_read(path.text, MAX_PHOTOS, photos, &why) == 0) return 0;
    return fs_error_set(err, why.code, "%s: remove it, and `flashsplat train %s --force` makes it again", why.message,
                        out);
}

Separation fs_scene_separation(const char *name)
{
    int s = 0;
    while (s < SEPARATIONS && strcmp(fs_scene_separations[s], name) != 0) s++;
    return (Separation)s;
}

void fs_scene_set_kind(Scene *scene, const Settings *set)
{
    scene->separation = fs_scene_separation(set->separation);
    scene->shared_geometry = scene->separation != SEPARATION_FULL || strcmp(set->geometry, "shared") == 0;
    scene->pane_beta = scene->separation == SEPARATION_NONE || strcmp(set->beta, "pane") == 0;
}

void fs_scene_free(Scene *scene)
{
    for (int l = 0; l < LAYERS; l++) fs_cloud_free(&scene->cloud[l]);
    fs_radiance_free(&scene->field);
    fs_image_free(&scene->veil.light);
    *scene = (Scene){0};
}

void fs_scene_lift(Scene *scene, double factor)
{
    const Layer lit[] = {LAYER_T_F, LAYER_T_N, LAYER_R};
    float toned = fs_tone_encode((float)factor);
    for (size_t l = 0; l < sizeof lit / sizeof *lit; l++) {
        Cloud *cloud = &scene->cloud[lit[l]];
        for (size_t i = 0; i < 3 * (size_t)cloud->n; i++) cloud->field[CLOUD_COLORS][i] *= toned;
    }
    for (size_t i = 0; i < fs_image_values(&scene->veil.light); i++) scene->veil.light.px[i] *= (float)factor;
    scene->veil.unit *= factor;
}

int fs_scene_copy(Scene *to, const Scene *from, FsError *err)
{
    int rc = 0;
    *to = *from;
    memset(to->cloud, 0, sizeof to->cloud);
    to->field = (Radiance){0};
    to->veil.light = (Image){0};
    if (fs_pane_veil_is(&from->veil)) TRY(fs_image_copy(&to->veil.light, &from->veil.light, err));
    TRY(fs_radiance_copy(&to->field, &from->field, err));
    for (int l = 0; l < LAYERS; l++)
        if (from->cloud[l].n) TRY(fs_cloud_copy(&to->cloud[l], &from->cloud[l], err));
fail:
    if (rc < 0) fs_scene_free(to);
    return rc;
}

// ---- model.json: one table of its numbers ----

typedef struct Number {
    const char *name;
    size_t offset;
    int n;
    double min, max;
    bool optional; // 0 where older files lack it
} Number;

static const Number numbers[] = {
    {"pane_normal", offsetof(Scene, pane.normal), 3, -1.001, 1.001},
    {"pane_f0", offsetof(Scene, pane.f0), 1, 0, 1},
    {"pane_dimming", offsetof(Scene, pane.dimming), 1, 0, FS_OPTICS_MOST},
    {"flash_return", offsetof(Scene, flash_return), 1, 0, 1},
    {"rare", offsetof(Scene, rare), 1, 0, 1e6, .optional = true},
    {"gain_color", offsetof(Scene, gain_color), 3, 0, 1e6},
    {"flash_distance", offsetof(Scene, flash_distance), 1, 0, 1e12},
    {"extent", offsetof(Scene, extent), 1, 1e-12, 1e12},
    {"metres_per_unit", offsetof(Scene, metres_per_unit), 1, 0, 1e12},
    {"vignetting", offsetof(Scene, vignetting), FS_OPTICS_VIGNETTING, -2, 2, .optional = true},
    {"response", offsetof(Scene, response), FS_OPTICS_KNOTS, -1, 1, .optional = true},
    {"veil_origin", offsetof(Scene, veil.origin), 3, -1e12, 1e12, .optional = true},
    {"veil_right", offsetof(Scene, veil.right), 3, -1.001, 1.001, .optional = true},
    {"veil_down", offsetof(Scene, veil.down), 3, -1.001, 1.001, .optional = true},
    {"veil_cell", offsetof(Scene, veil.cell), 1, 0, 1e12, .optional = true},
    {"veil_distance", offsetof(Scene, veil.distance), 1, 0, 1e12, .optional = true},
    {"veil_ambient", offsetof(Scene, veil.ambient), 3, 0, 1e6, .optional = true},
    {"veil_unit", offsetof(Scene, veil.unit), 1, 0, 1e6, .optional = true},
};
#define N_NUMBERS (sizeof numbers / sizeof *numbers)

// The shape of radiance fields, which says how many floats field.bin has.
static const struct {
    const char *name;
    size_t offset;
} shape_numbers[] = {
    {"levels", offsetof(RadianceShape, levels)},
    {"log2_rows", offsetof(RadianceShape, log2_rows)},
    {"coarsest", offsetof(RadianceShape, coarsest)},
    {"finest", offsetof(RadianceShape, finest)},
    {"hidden", offsetof(RadianceShape, hidden)},
    {"grid", offsetof(RadianceShape, grid)},
    {"samples", offsetof(RadianceShape, samples)},
    {"colors_T", offsetof(RadianceShape, colors[VOLUME_T])},
    {"colors_R", offsetof(RadianceShape, colors[VOLUME_R])},
};
#define N_SHAPE (sizeof shape_numbers / sizeof *shape_numbers)

static json_t *field_to_json(const Radiance *field)
{
    const RadianceFrame *f = &field->frame;
    json_t *shape = json_object();
    for (size_t i = 0; i < N_SHAPE; i++)
        json_object_set_new(shape, shape_numbers[i].name,
                            json_integer(*(const int *)((const char *)&field->shape + shape_numbers[i].offset)));
    return json_pack("{s:o, s:o, s:o, s:o, s:f, s:f, s:f}", "shape", shape, "w2c", fs_json_file_doubles(f->w2c, 12),
                     "low", fs_json_file_doubles(f->low, 2), "high", fs_json_file_doubles(f->high, 2), "near", f->near,
                     "far", f->far, "parts", f->parts);
}

static json_t *to_json(const Scene *scene)
{
    json_t *clouds = json_object();
    json_t *root =
        json_pack("{s:i, s:s, s:b, s:b}", "version", VERSION, "separation", fs_scene_separations[scene->separation],
                  "shared_geometry", scene->shared_geometry, "pane_beta", scene->pane_beta);
    for (size_t i = 0; i < N_NUMBERS; i++) {
        const double *v = (const double *)((const char *)scene + numbers[i].offset);
        json_t *value = numbers[i].n == 1 ? json_real(*v) : json_array();
        for (int k = 0; k < numbers[i].n && numbers[i].n > 1; k++) json_array_append_new(value, json_real(v[k]));
        json_object_set_new(root, numbers[i].name, value);
    }
    for (int l = 0; l < LAYERS; l++)
        if (scene->cloud[l].n) json_object_set_new(clouds, fs_layers[l].name, json_integer(scene->cloud[l].n));
    json_object_set_new(root, "clouds", clouds);
    if (fs_radiance_is(&scene->field)) json_object_set_new(root, "field", field_to_json(&scene->field));
    return root;
}

static int number_check(const Number *number, double v, const char *path, FsError *err)
{
    if (isfinite(v) && v >= number->min && v <= number->max) return 0;
    return fs_error_input(err, "%s: %s is %g, expected a number from %g to %g", path, number->name, v, number->min,
                          number->max);
}

// What is divided by, or whose logarithm is taken, where the switches say so.
static int switched_check(const Scene *scene, const char *path, FsError *err)
{
    const double *gain = scene->gain_color, *n = scene->pane.normal;
    double length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (fs_scene_lit(scene) && !(gain[0] > 0 && gain[1] > 0 && gain[2] > 0 && scene->flash_distance > 0))
        return fs_error_input(err, "%s: gain_color, flash_distance: expected numbers above 0 where the flash lights T",
                              path);
    if (scene->pane_beta && !(fabs(length2 - 1) < 0.01))
        return fs_error_input(err, "%s: pane_normal: expected a vector of length 1", path);
    return 0;
}

static int write_model(const Scene *scene, const char *path, FsError *err)
{
    for (size_t i = 0; i < N_NUMBERS; i++)
        for (int k = 0; k < numbers[i].n; k++)
            MUST(number_check(&numbers[i], ((const double *)((const char *)scene + numbers[i].offset))[k], path, err));
    MUST(switched_check(scene, path, err));
    return fs_json_file_write(path, to_json(scene), JSON_INDENT(1) | JSON_REAL_PRECISION(17), err);
}

static int read_flag(const json_t *root, const char *name, bool *flag, const char *path, FsError *err)
{
    json_t *value = json_object_get(root, name);
    if (!json_is_boolean(value)) return fs_error_input(err, "%s: %s: expected true or false", path, name);
    *flag = json_is_true(value);
    return 0;
}

// Scenes written before there was a choice are full.
static int read_separation(const json_t *root, Scene *scene, const char *path, FsError *err)
{
    json_t *value = json_object_get(root, "separation");
    if (!value) return 0;
    scene->separation = json_is_string(value) ? fs_scene_separation(json_string_value(value)) : SEPARATIONS;
    bool ok = scene->separation < SEPARATIONS;
    if (ok && json_object_get(root, "field")) return 0;
    if (ok && (scene->separation == SEPARATION_FULL || scene->shared_geometry)) return 0;
    scene->separation = SEPARATION_FULL;
    return fs_error_input(err, "%s: separation: expected full, or with shared geometry flashless, linear or none",
                          path);
}

static int read_number(const json_t *root, const Number *number, Scene *scene, const char *path, FsError *err)
{
    json_t *value = json_object_get(root, number->name);
    if (!value && number->optional) return 0;
    double *to = (double *)((char *)scene + number->offset);
    bool ok =
        number->n == 1 ? json_is_number(value) : json_is_array(value) && json_array_size(value) == (size_t)number->n;
    for (int k = 0; k < number->n && ok; k++) {
        json_t *item = number->n == 1 ? value : json_array_get(value, (size_t)k);
        ok = json_is_number(item);
        to[k] = json_number_value(item);
        if (ok) MUST(number_check(number, to[k], path, err));
    }
    if (ok) return 0;
    return fs_error_input(err, "%s: %s: expected %d number(s)", path, number->name, number->n);
}

static int read_model(Scene *scene, json_t **root, const char *path, FsError *err)
{
    MUST(fs_json_file_read(path, 1 << 20, root, err));
    json_t *version = json_object_get(*root, "version");
    if (!json_is_integer(version) || json_integer_value(version) != VERSION)
        return fs_error_input(err, "%s: expected \"version\": %d; made by another version of the program", path,
                              VERSION);
    MUST(read_flag(*root, "shared_geometry", &scene->shared_geometry, path, err));
    MUST(read_flag(*root, "pane_beta", &scene->pane_beta, path, err));
    MUST(read_separation(*root, scene, path, err));
    for (size_t i = 0; i < N_NUMBERS; i++) MUST(read_number(*root, &numbers[i], scene, path, err));
    return switched_check(scene, path, err);
}

// ---- clouds ----

// What the layers and switches ask of a cloud.
static int cloud_check(const Scene *scene, int layer, const char *path, FsError *err)
{
    const Cloud *cloud = &scene->cloud[layer];
    if (cloud->n == 0) return 0;
    if ((layer == LAYER_T_F && scene->shared_geometry) || (layer == LAYER_BETA && scene->pane_beta))
        return fs_error_input(err, "%s: a scene of this kind has no cloud %s", path, fs_layers[layer].name);
    if (cloud->width[CLOUD_COLORS] != fs_layers[layer].channels)
        return fs_error_input(err, "%s: %d colour channel(s), expected %d", path, cloud->width[CLOUD_COLORS],
                              fs_layers[layer].channels);
    if (layer == LAYER_T_N && scene->shared_geometry && cloud->width[CLOUD_GAINS] != 1)
        return fs_error_input(err, "%s: no flash gains, which shared geometry needs", path);
    if (cloud->width[CLOUD_COVERS] && !(layer == LAYER_T_N && fs_scene_lit(scene)))
        return fs_error_input(err, "%s: covers, which only T_N of a shared geometry under the flash has", path);
    for (int i = 0; i < cloud->n && cloud->width[CLOUD_COVERS]; i++)
        if (!(cloud->field[CLOUD_COVERS][i] >= 0 && cloud->field[CLOUD_COVERS][i] <= 1))
            return fs_error_input(err, "%s: Gaussian %d: cover is %g, expected 0 to 1", path, i,
                                  (double)cloud->field[CLOUD_COVERS][i]);
    return 0;
}

static int veil_check(const Scene *scene, const char *path, FsError *err)
{
    if (!fs_pane_veil_is(&scene->veil)) return 0;
    if (!fs_scene_lit(scene) || !scene->pane_beta)
        return fs_error_input(err, "%s: a veil, which only scenes behind a pane that are lit by the flash have", path);
    return fs_pane_veil_check(&scene->veil, path, err);
}

int fs_scene_write(const Scene *scene, const char *dir, FsError *err)
{
    FilePath part[LAYERS], path[LAYERS], field = fs_file_at("%s/field.bin", dir), veil = fs_file_at("%s/veil.tif", dir);
    int rc;
    for (int l = 0; l < LAYERS; l++) {
        path[l] = fs_file_at("%s/%s.ply", dir, fs_layers[l].name);
        part[l] = fs_file_at("%s.new", path[l].text);
    }
    TRY(veil_check(scene, veil.text, err));
    TRY(fs_file_mkdirs(dir, err));
    for (int l = 0; l < LAYERS; l++) {
        TRY(cloud_check(scene, l, path[l].text, err));
        if (scene->cloud[l].n) TRY(fs_cloud_ply_write(&scene->cloud[l], part[l].text, err));
    }
    // All written: the old scene gives way as nearly at once as files can.
    for (int l = 0; l < LAYERS; l++)
        if (scene->cloud[l].n) TRY(fs_file_rename(part[l].text, path[l].text, err));
    if (fs_radiance_is(&scene->field)) TRY(fs_radiance_write(&scene->field, field.text, err));
    if (fs_pane_veil_is(&scene->veil)) TRY(fs_tiff_write_float(veil.text, &scene->veil.light, err));
    TRY(write_model(scene, fs_file_at("%s/model.json", dir).text, err));
    for (int l = 0; l < LAYERS; l++)
        if (!scene->cloud[l].n) fs_owned_remove(path[l].text);
    if (!fs_radiance_is(&scene->field)) fs_owned_remove(field.text);
    if (!fs_pane_veil_is(&scene->veil)) fs_owned_remove(veil.text);
fail:
    for (int l = 0; l < LAYERS && rc < 0; l++) fs_owned_remove(part[l].text);
    return rc;
}

// What a stage left, or a checkpoint.
static int check_there(const char *dir, const char *file, FsError *err)
{
    const char *folder = fs_file_name(dir);
    FilePath path = fs_file_at("%s/%s", dir, file), name = fs_file_at("%s/%s", folder, file);
    FilePath out = fs_file_at("%.*s", folder > dir ? (int)(folder - dir - 1) : 1, folder > dir ? dir : ".");
    if (fs_file_exists(path.text)) return 0;
    if (strcmp(folder, "start") == 0) return fs_project_missing(out.text, FS_STAGE_INITIALISE, name.text, err);
    if (strcmp(folder, "clouds") == 0) return fs_project_missing(out.text, FS_STAGE_TRAIN, name.text, err);
    return fs_error_input(err, "%s: is missing, which makes the rest worthless: begin anew, without --resume",
                          path.text);
}

// rc; where a file of a stage's is damaged, what makes it again goes after the words.
static int check_whole(int rc, const char *dir, FsError *err)
{
    const char *folder = fs_file_name(dir);
    if (strcmp(folder, "start") == 0)
        return fs_error_then(rc, "remove it, and `flashsplat initialise OUT --force` makes it again", err);
    if (strcmp(folder, "clouds") == 0)
        return fs_error_then(rc, "remove it, and `flashsplat train OUT --force` makes it again", err);
    return rc;
}

static int read_cloud(Scene *scene, int layer, const json_t *clouds, const char *dir, FsError *err)
{
    json_t *count = json_object_get(clouds, fs_layers[layer].name);
    if (!count) return 0;
    FilePath path = fs_file_at("%s/%s.ply", dir, fs_layers[layer].name);
    MUST(check_there(dir, fs_file_name(path.text), err));
    MUST(check_whole(fs_cloud_ply_read(&scene->cloud[layer], path.text, err), dir, err));
    if (json_is_integer(count) && json_integer_value(count) == scene->cloud[layer].n)
        return cloud_check(scene, layer, path.text, err);
    return fs_error_input(
        err, "%s: %d Gaussians, but model.json beside it was written with another cloud: run that stage again",
        path.text, scene->cloud[layer].n);
}

static int read_veil(Scene *scene, const char *dir, FsError *err)
{
    if (!fs_pane_veil_is(&scene->veil)) return 0;
    FilePath path = fs_file_at("%s/veil.tif", dir);
    MUST(check_there(dir, "veil.tif", err));
    MUST(check_whole(fs_tiff_read(path.text, &scene->veil.light, err), dir, err));
    return veil_check(scene, path.text, err);
}

// ---- radiance fields ----

static int read_list(const json_t *value, double *x, int n)
{
    bool ok = json_array_size(value) == (size_t)n;
    for (int k = 0; k < n && ok; k++) {
        ok = json_is_number(json_array_get(value, (size_t)k));
        x[k] = json_number_value(json_array_get(value, (size_t)k));
    }
    return ok ? 0 : -1;
}

static int read_field(Scene *scene, const json_t *field, const char *dir, FsError *err)
{
    if (!field) return 0;
    MUST(check_there(dir, "field.bin", err));
    FilePath model = fs_file_at("%s/model.json", dir);
    RadianceShape shape = {0};
    RadianceFrame f = {.near = json_number_value(json_object_get(field, "near")),
                       .far = json_number_value(json_object_get(field, "far")),
                       .parts = json_number_value(json_object_get(field, "parts"))};
    for (size_t i = 0; i < N_SHAPE; i++) {
        json_int_t x = json_integer_value(json_object_get(json_object_get(field, "shape"), shape_numbers[i].name));
        *(int *)((char *)&shape + shape_numbers[i].offset) = x >= 0 && x <= 1 << 20 ? (int)x : -1;
    }
    if (read_list(json_object_get(field, "w2c"), f.w2c, 12) || read_list(json_object_get(field, "low"), f.low, 2) ||
        read_list(json_object_get(field, "high"), f.high, 2))
        return fs_error_input(err, "%s: field: expected w2c (12 numbers), low and high (2 each)", model.text);
    MUST(fs_radiance_check(&shape, &f, model.text, err));
    bool two = scene->separation == SEPARATION_FULL, mirrored = scene->separation != SEPARATION_NONE;
    if (scene->separation == SEPARATION_LINEAR || !scene->shared_geometry || scene->pane_beta ||
        shape.colors[VOLUME_T] != (two ? 6 : 3) || shape.colors[VOLUME_R] != (mirrored ? 3 : 0))
        return fs_error_input(err, "%s: field: not of this kind of scene", model.text);
    return fs_radiance_read(&scene->field, &shape, &f, fs_file_at("%s/field.bin", dir).text, err);
}

int fs_scene_read(Scene *scene, const char *dir, FsError *err)
{
    *scene = (Scene){0};
    json_t *root = NULL;
    FilePath model = fs_file_at("%s/model.json", dir);
    int rc;
    TRY(check_there(dir, "model.json", err));
    TRY(check_whole(read_model(scene, &root, model.text, err), dir, err));
    json_t *clouds = json_object_get(root, "clouds");
    int n = 0;
    for (int l = 0; l < LAYERS; l++) TRY(read_cloud(scene, l, clouds, dir, err));
    for (int l = 0; l < LAYERS; l++) n += scene->cloud[l].n > 0;
    TRY(read_veil(scene, dir, err));
    TRY(read_field(scene, json_object_get(root, "field"), dir, err));
    if (n && fs_radiance_is(&scene->field))
        TRY(fs_error_input(err, "%s: \"field\": a scene has clouds or fields, not both", model.text));
    if (!n && !fs_radiance_is(&scene->field))
        rc = fs_error_input(err, "%s: \"clouds\": a scene of no Gaussians", model.text);
fail:
    if (rc < 0) fs_scene_free(scene);
    json_decref(root);
    return rc;
}

float fs_scene_white(const double response[])
{
    const double spacing = (double)FS_OPTICS_SPACING;
    int k = FS_OPTICS_KNOTS - 1;
    while (k > 0 && k * spacing + response[k] > 1) k--; // the last knot that is not brighter than white
    double left = 1 - k * spacing - response[k], rise = 1;
    if (k + 1 < FS_OPTICS_KNOTS) rise += (response[k + 1] - response[k]) / spacing;
    return (float)pow(fmax(k * spacing + left / rise, 1), 1 / (double)FS_OPTICS_GAMMA);
}

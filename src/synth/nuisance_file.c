// truth/nuisance.json: the values of the capture and of each photo.
#include <math.h>

#include "base/file.h"
#include "base/json_file.h"
#include "synth/nuisance.h"

enum { CURVE_SAMPLES = 64 };

static json_t *photo_json(const PhotoNuisance *p, const Shot *shot)
{
    const Exposure *e = &p->exposure;
    return json_pack("{s:s, s:b, s:f, s:i, s:f, s:f, s:f, s:f, s:f, s:f, s:o, s:f, s:f, s:f, s:f, s:o}", "name",
                     shot->name, "flash", shot->flash, "shutter", 1.0 / e->shutter, "iso", e->iso, "fnumber",
                     e->f_number, "exposure_ambient", (double)p->ambient, "exposure_flash", (double)p->flash,
                     "gain_flash", (double)p->gain_flash, "gain_T", (double)p->gain_behind, "gain_R",
                     (double)p->gain_room, "white_balance", fs_json_file_floats(e->balance, 3), "blur_px",
                     (double)p->blur_px, "blur_deg", (double)p->blur_degrees, "focus_m", (double)p->focus_m, "clipped",
                     p->clipped, "mirrored_flash_px", fs_json_file_floats(p->flash_px, 3));
}

static json_t *style_json(const CameraStyle *s)
{
    json_t *curve = json_array();
    for (int i = 0; i < CURVE_SAMPLES; i++) { // closer together in the dark
        float light = powf((float)i / (CURVE_SAMPLES - 1), 2.2f);
        json_array_append_new(curve, json_pack("[ff]", (double)light, (double)fs_style_curve(s, light)));
    }
    return json_pack("{s:o, s:o, s:f}", "curve", curve, "matrix",
                     s->own ? fs_json_file_floats(s->matrix, 9) : json_null(), "sharpening", (double)s->sharpen);
}

static json_t *lens_json(const Lens *lens)
{
    if (!lens->width) return json_null();
    json_t *params = json_array();
    int n;
    const char *model = fs_lens_model_name(lens->model, &n);
    for (int i = 0; i < n; i++) json_array_append_new(params, json_real(lens->param[i]));
    return json_pack("{s:s, s:o}", "model", model, "params", params);
}

int fs_nuisance_write(const Nuisance *u, const char *dir, const char *scene, const Shot *shot, unsigned seed,
                      FsError *err)
{
    json_t *faults = json_object(), *photos = json_array();
    for (int i = 0; i < FIELD_FAULTS; i++)
        json_object_set_new(faults, fs_field_name(i), json_real((double)u->field.strength[i]));
    for (int i = 0; i < u->n; i++) json_array_append_new(photos, photo_json(&u->photo[i], &shot[i]));
    json_t *root = json_pack(
        "{s:o, s:i, s:s, s:s, s:o, s:f, s:o, s:o, s:o, s:o}", "switches", faults, "seed", (int)seed, "scene", scene,
        "note",
        "light = exposure_ambient * (gain_T * T_N + gain_R * R) + exposure_flash * gain_flash * (flash's part); "
        "vignetting keeps 1 + k0 r^2 + k1 r^4 + k2 r^6 of it, r = 1 in the corner; jpeg: value = curve(matrix * light "
        "* "
        "white_balance), then sharpened",
        "tint", fs_json_file_floats(&u->tint.x, 3), "second_pane_m", (double)u->gap, "vignetting",
        fs_json_file_floats(u->vignetting, 3), "distortion", lens_json(&u->lens), "jpeg", style_json(&u->style),
        "photos", photos);
    return fs_json_file_write(fs_file_at("%s/nuisance.json", dir).text, root, JSON_INDENT(1) | JSON_REAL_PRECISION(9),
                              err);
}

// Every fault draws from random numbers of its own, so that it is the same alone and with others.
#include "synth/nuisance.h"

#include <stdlib.h>

#define REFERENCE_SIDE 600.0f // shake, defocus and glare are told in pixels of a photo so wide
#define FLASH_RADIUS 0.03     // metres
#define MIRRORED_FLASH 20.0f  // of white
#define GLARE_REACH 25.0f     // pixels in which glare falls to 1 / e

static Rng rng_of(const Spec *spec, FieldFault fault)
{
    return fs_rng_new(spec->seed * 15485863ull + 7717u * ((unsigned)fault + 1));
}

static float deviation(Rng *rng) // normal, no outliers
{
    return fminf(fmaxf(fs_rng_normal(rng), -2.5f), 2.5f);
}

static void draw_gains(Nuisance *u, const Spec *spec)
{
    Rng jitter = rng_of(spec, FIELD_FLASH_JITTER), drift = rng_of(spec, FIELD_DRIFT);
    float at[2], mean[2] = {0, 0}, s = u->field.strength[FIELD_DRIFT];
    for (int k = 0; k < 2; k++) at[k] = deviation(&drift);
    for (int i = 0; i < u->n; i++) {
        PhotoNuisance *p = &u->photo[i];
        p->gain_flash = 1 + u->field.strength[FIELD_FLASH_JITTER] * deviation(&jitter);
        p->gain_behind = at[0];
        p->gain_room = at[1];
        for (int k = 0; k < 2; k++) {
            mean[k] += at[k] / (float)u->n;
            at[k] = 0.8f * at[k] + 0.6f * deviation(&drift); // clouds: each photo is like the one before
        }
    }
    for (int i = 0; i < u->n; i++) { // about the nominal light
        PhotoNuisance *p = &u->photo[i];
        p->gain_behind = 1 + fmaxf(0.5f * s * (p->gain_behind - mean[0]), -0.9f);
        p->gain_room = 1 + fmaxf(s * (p->gain_room - mean[1]), -0.9f);
    }
}

// Longer or shorter, with and without an ISO that makes up for it in the ambient light.
static void draw_exposures(Nuisance *u, const Spec *spec)
{
    static const struct {
        int shutter, iso;
    } other[4] = {{20, 100}, {60, 320}, {60, 200}, {30, 160}};
    Rng choose = rng_of(spec, FIELD_SHUTTER), balance = rng_of(spec, FIELD_WHITE_BALANCE);
    int left = (int)lroundf(u->field.strength[FIELD_SHUTTER] * (float)u->n); // photos still to choose
    float under = exp2f(-u->field.strength[FIELD_UNDER]), s = u->field.strength[FIELD_WHITE_BALANCE];
    for (int i = 0; i < u->n; i++) {
        PhotoNuisance *p = &u->photo[i];
        p->exposure = SHOT_EXPOSURE;
        bool odd = fs_rng_below(&choose, u->n - i) < left;
        int which = fs_rng_below(&choose, 4);
        if (odd) {
            left--;
            p->exposure.shutter = other[which].shutter;
            p->exposure.iso = other[which].iso;
        }
        p->exposure.f_number = round(10 * p->exposure.f_number / sqrt((double)under)) / 10;
        p->flash = under * (float)p->exposure.iso / SHOT_ISO;
        p->ambient = p->flash * SHOT_SHUTTER / (float)p->exposure.shutter;
        float warm = deviation(&balance), green = deviation(&balance);
        p->exposure.balance[0] = expf(s * (0.9f * warm + 0.4f * green));
        p->exposure.balance[2] = expf(s * (0.4f * green - 0.9f * warm));
        p->exposure.automatic = s > 0;
    }
}

static void draw_blur(Nuisance *u, const Spec *spec, float px, float distance)
{
    Rng shake = rng_of(spec, FIELD_SHAKE), focus = rng_of(spec, FIELD_DEFOCUS);
    int bad[2] = {fs_rng_below(&shake, u->n)}; // each by itself: initializers are evaluated in any order
    bad[1] = fs_rng_below(&shake, u->n - 1);
    if (bad[1] >= bad[0]) bad[1]++;
    for (int i = 0; i < u->n; i++) {
        PhotoNuisance *p = &u->photo[i];
        float share = fs_rng_uniform(&shake);
        if (i == bad[0] || i == bad[1]) share = 2.4f;
        p->blur_px = px * u->field.strength[FIELD_SHAKE] * share;
        p->blur_degrees = 180 * fs_rng_uniform(&shake);
        p->focus_m = u->field.strength[FIELD_DEFOCUS] > 0 ? distance * (1 + 0.08f * deviation(&focus)) : 0;
    }
}

static void draw_lens(Nuisance *u, const Spec *spec, const Camera *camera)
{
    float lost = u->field.strength[FIELD_VIGNETTING], s = u->field.strength[FIELD_DISTORTION];
    Rng rng = rng_of(spec, FIELD_VIGNETTING);
    float low = 0.3f + 0.4f * fs_rng_uniform(&rng), middle = (1 - low) * fs_rng_uniform(&rng);
    u->vignetting[0] = -lost * low;
    u->vignetting[1] = -lost * middle;
    u->vignetting[2] = -lost * (1 - low - middle);
    if (s <= 0) return;
    rng = rng_of(spec, FIELD_DISTORTION);
    double k1 = -0.06 - 0.06 * (double)fs_rng_uniform(&rng), k2 = 0.03 * (double)fs_rng_uniform(&rng);
    double p1 = 0.001 * (double)fs_rng_uniform(&rng) - 0.0005, p2 = 0.001 * (double)fs_rng_uniform(&rng) - 0.0005;
    u->lens = (Lens){LENS_OPENCV,
                     camera->width,
                     camera->height,
                     {camera->fx, camera->fy, camera->cx, camera->cy, (double)s * k1, (double)s * k2, (double)s * p1,
                      (double)s * p2}};
}

// Who takes the photo stands beside the camera, held at arm's length, where the pane mirrors them into the picture:
// dark against the room, and the flash is before them.
static Figure photographer(const Layout *l, const Camera *camera)
{
    const double *m = camera->w2c;
    double c[3];
    fs_camera_centre(camera, c);
    Vec eye = vec((float)c[0], (float)c[1], (float)c[2]), ahead = vec((float)m[8], (float)m[9], (float)m[10]);
    bool flat = fabsf(l->pane_normal.z) > 0.5f; // of a case: they bend over it
    Vec along = vec_mad(ahead, l->pane_normal, -vec_dot(ahead, l->pane_normal));
    along.z = 0;
    if (vec_length(along) < 0.3f) along = vec_cross(ahead, vec(0, 0, 1)); // straight on: on the right
    along = vec_unit(along);
    Figure f = {
        .skin = vec(0.1f, 0.07f, 0.055f), .cloth = vec(0.03f, 0.03f, 0.035f), .legs = vec(0.025f, 0.025f, 0.03f)};
    f.feet = vec_mad(eye, along, flat ? 1.05f : 0.5f);
    f.feet.z = 0;
    f.size = flat ? 0.85f : eye.z / 1.5f;
    f.right = flat ? vec_cross(along, vec(0, 0, 1)) : along;
    f.front = vec_cross(vec(0, 0, 1), f.right);
    return f;
}

// Walks through the room, parallel to the pane, six photos of ten in view.
static Figure pedestrian(const Layout *l, Rng rng, int photo)
{
    bool flat = fabsf(l->pane_normal.z) > 0.5f;
    float hue = fs_rng_uniform(&rng), start = fs_rng_uniform(&rng);
    Color coat = fs_canvas_hsv(hue, 0.8f, 0.75f);
    float way = fmodf(start + 0.1f * (float)photo, 1); // of the way across
    Figure f = {.size = 0.95f + 0.1f * fs_rng_uniform(&rng), .skin = vec(0.5f, 0.36f, 0.28f), .lit = true};
    f.cloth = vec(coat.x * coat.x, coat.y * coat.y, coat.z * coat.z); // linear
    f.legs = vec(0.06f, 0.07f, 0.12f);
    f.feet = flat ? vec(l->pane_point.x - 1.8f + 3.6f * way, l->pane_point.y + 0.95f, 0)
                  : vec(l->pane_point.x + l->side * (-1.5f + 6 * way), -2.1f, 0);
    f.right = vec(0, 1, 0); // seen from the side
    f.front = vec(-1, 0, 0);
    return f;
}

// Where the pane mirrors the flash.
static void place_flash(const Layout *l, const Camera *camera, const Lens *lens, float flash_px[3])
{
    Vec image = fs_trace_mirrored_flash(l, camera);
    const double world[3] = {(double)image.x, (double)image.y, (double)image.z};
    double at[2], depth = fs_camera_project(camera, world, at);
    if (depth <= 0) return;
    const double ray[2] = {(at[0] - camera->cx) / camera->fx, (at[1] - camera->cy) / camera->fy};
    if (lens->width) fs_lens_project(lens, ray, at);
    flash_px[0] = (float)at[0];
    flash_px[1] = (float)at[1];
    flash_px[2] = (float)(camera->fx * FLASH_RADIUS / depth);
}

int fs_nuisance_draw(Nuisance *u, const Spec *spec, const Layout *layout, const Shot *shot, FsError *err)
{
    const Camera *camera = &shot->camera;
    float distance = vec_length(vec_sub(layout->look_at, layout->stand));
    float side = (float)(camera->width > camera->height ? camera->width : camera->height), px = side / REFERENCE_SIDE;
    *u = (Nuisance){.field = spec->field, .n = spec->photos};
    u->photo = calloc((size_t)u->n, sizeof *u->photo);
    if (!u->photo) return fs_error_memory(err);
    draw_gains(u, spec);
    draw_exposures(u, spec);
    draw_blur(u, spec, px, distance);
    draw_lens(u, spec, camera);
    // a point at infinity is smeared over 2 aperture / focus, in units of the ray
    u->aperture = 0.5f * u->field.strength[FIELD_DEFOCUS] * px * distance / (float)camera->fx;
    for (int i = 0; i < u->n; i++) {
        u->photo[i].figure[0] = photographer(layout, &shot[i].camera);
        u->photo[i].figure[1] = pedestrian(layout, rng_of(spec, FIELD_PEDESTRIAN), i);
        place_flash(layout, &shot[i].camera, &u->lens, u->photo[i].flash_px);
    }
    u->dirt_seed = spec->seed * 31u + 5;
    u->tint = layout->tint;
    u->gap = layout->gap;
    if (u->field.strength[FIELD_JPEG] > 0)
        u->style = fs_style_draw(u->field.strength[FIELD_JPEG], rng_of(spec, FIELD_JPEG));
    return 0;
}

void fs_nuisance_free(Nuisance *u)
{
    free(u->photo);
    *u = (Nuisance){0};
}

const Optics *fs_nuisance_optics(const Nuisance *u, int photo, Optics *optics)
{
    *optics = (Optics){.lens = u->lens, .aperture = u->aperture, .focus = u->photo[photo].focus_m};
    for (int i = 0; i < 2; i++)
        if (u->field.strength[FIELD_PHOTOGRAPHER + i] > 0)
            optics->figure[optics->n_figures++] = u->photo[photo].figure[i];
    optics->dirt = u->field.strength[FIELD_DIRT];
    optics->dirt_seed = u->dirt_seed;
    return u->lens.width || u->aperture > 0 || optics->n_figures || optics->dirt > 0 ? optics : NULL;
}

// The mean along a line of `length` pixels, the pixel in its middle.
static void smear(const Image *from, Image *to, float length, float degrees)
{
    int steps = 2 * (int)ceilf(2 * length) + 1;
    float dx = length * cosf(degrees * 0.017453293f), dy = length * sinf(degrees * 0.017453293f);
    for (int y = 0; y < from->height; y++)
        for (int x = 0; x < from->width; x++)
            for (int k = 0; k < steps; k++) {
                float t = ((float)k + 0.5f) / (float)steps - 0.5f;
                float u = fminf(fmaxf((float)x + t * dx, 0), (float)(from->width - 1));
                float v = fminf(fmaxf((float)y + t * dy, 0), (float)(from->height - 1));
                int i = (int)u, j = (int)v, i1 = i + (i < from->width - 1), j1 = j + (j < from->height - 1);
                float a = u - (float)i, b = v - (float)j;
                const float *p[4] = {fs_image_at(from, i, j), fs_image_at(from, i1, j), fs_image_at(from, i, j1),
                                     fs_image_at(from, i1, j1)};
                for (int c = 0; c < 3; c++)
                    fs_image_at(to, x, y)[c] +=
                        ((1 - b) * ((1 - a) * p[0][c] + a * p[1][c]) + b * ((1 - a) * p[2][c] + a * p[3][c])) /
                        (float)steps;
            }
}

// The mirror image of the flash, beyond all that a sensor holds, and what lens and pane scatter of it.
static void add_mirrored_flash(const PhotoNuisance *p, float glare, Image *light)
{
    float reach = GLARE_REACH * (float)(light->width > light->height ? light->width : light->height) / REFERENCE_SIDE;
    for (int y = 0; y < light->height; y++)
        for (int x = 0; x < light->width; x++) {
            float r = hypotf((float)x + 0.5f - p->flash_px[0], (float)y + 0.5f - p->flash_px[1]);
            float more = glare * expf(-r / reach) + MIRRORED_FLASH * fminf(fmaxf(p->flash_px[2] - r + 0.5f, 0), 1);
            for (int c = 0; c < 3; c++) fs_image_at(light, x, y)[c] += p->flash * p->gain_flash * more;
        }
}

static void vignette(const Nuisance *u, Image *light)
{
    double cx = 0.5 * light->width, cy = 0.5 * light->height, corner = cx * cx + cy * cy;
    const float *k = u->vignetting;
    for (int y = 0; y < light->height; y++)
        for (int x = 0; x < light->width; x++) {
            float r2 = (float)((pow(x + 0.5 - cx, 2) + pow(y + 0.5 - cy, 2)) / corner);
            for (int c = 0; c < 3; c++) fs_image_at(light, x, y)[c] *= 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
        }
}

int fs_nuisance_gather(const Nuisance *u, int photo, bool flash, const Traced *traced, Image *light, FsError *err)
{
    const PhotoNuisance *p = &u->photo[photo];
    const Image *layer = traced->layer;
    Image ambient = {0};
    int rc = 0;
    *light = (Image){0};
    TRY(fs_image_copy(&ambient, &layer[TRACE_T_N], err));
    for (size_t i = 0; i < fs_image_values(&ambient); i++)
        ambient.px[i] = p->ambient * (p->gain_behind * ambient.px[i] + p->gain_room * layer[TRACE_R_N].px[i]);
    TRY(fs_image_new(light, ambient.width, ambient.height, 3, err));
    smear(&ambient, light, p->blur_px, p->blur_degrees);
    if (flash) // a thousandth of a second: it stays sharp
        for (size_t i = 0; i < fs_image_values(light); i++)
            light->px[i] +=
                p->flash * p->gain_flash *
                (layer[TRACE_T_F].px[i] - layer[TRACE_T_N].px[i] + layer[TRACE_R_F].px[i] - layer[TRACE_R_N].px[i]);
    if (flash && u->field.strength[FIELD_MIRRORED_FLASH] > 0 && p->flash_px[2] > 0)
        add_mirrored_flash(p, u->field.strength[FIELD_MIRRORED_FLASH], light);
    vignette(u, light);
fail:
    fs_image_free(&ambient);
    if (rc < 0) fs_image_free(light);
    return rc;
}

#include "engine/as_shot.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "engine/view_plan.h"
#include "image/tone.h"

int fs_as_shot_open(AsShot *a, const Scene *scene, const char *out, FsError *err)
{
    *a = (AsShot){.scene = scene};
    return fs_scene_photos(out, &a->photos, err);
}

void fs_as_shot_close(AsShot *a)
{
    json_decref(a->photos);
    *a = (AsShot){0};
}

static void find_light(const AsShot *a, const char *name, PhotoState *state)
{
    static const char *const keys[] = {[PHOTO_T] = "transmitted", [PHOTO_R] = "mirrored", [PHOTO_FLASH] = "flash"};
    const json_t *photos = json_object_get(a->photos, "photos");
    for (size_t i = 0; i < json_array_size(photos); i++) {
        const json_t *photo = json_array_get(photos, i), *white = json_object_get(photo, "white_balance");
        const char *is = json_string_value(json_object_get(photo, "name"));
        for (size_t k = 0; k < PHOTO_NUMBERS && is && strcmp(is, name) == 0; k++) {
            double v = json_number_value(k < PHOTO_WHITE ? json_object_get(photo, keys[k])
                                                         : json_array_get(white, k - PHOTO_WHITE));
            if (v > 1e-3 && v < 1e3) state->x[k] = (float)log(v);
        }
    }
}

static float flash_of(const PhotoState *state, const View *view)
{
    if (!view->flash) return 0;
    return expf(state->x[PHOTO_FLASH]) * (view->flash_gain > 0 ? (float)view->flash_gain : 1);
}

// Between an image in linear light and planes, tone-mapped.
static void copy(Image *image, const Planes *planes, bool to_image)
{
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < image->height; y++)
            for (int x = 0; x < image->width; x++) {
                float *px = fs_image_at(image, x, y) + c, *plane = fs_planes_row(planes, c, y) + x;
                if (to_image)
                    *px = fs_tone_decode(*plane);
                else
                    *plane = fs_tone_encode(*px);
            }
}

// Linear light, in place.
static int calibrate(const CalibrationView *calibration, Image *image, FsError *err)
{
    int w = image->width, h = image->height;
    size_t floats = fs_planes_floats(w, h, 3);
    float *memory = aligned_alloc(64, 2 * floats * sizeof(float));
    if (!memory) return fs_error_memory(err);
    memset(memory, 0, 2 * floats * sizeof(float));
    Planes I = fs_planes_over(memory, w, h, 3), P = fs_planes_over(memory + floats, w, h, 3);
    copy(image, &I, false);
    fs_calibration_scalar.forward(calibration, &I, &P, 0, h);
    copy(image, &P, true);
    free(memory);
    return 0;
}

// What dirt on the pane sends back. image: as the camera sees it, linear light, in place.
static int add_veil(const Scene *scene, const PhotoState *state, const View *view, const Camera *camera, Image *image,
                    FsError *err)
{
    if (!fs_pane_veil_is(&scene->veil)) return 0;
    float *memory = aligned_alloc(64, fs_planes_floats(image->width, image->height, 3) * sizeof(float));
    if (!memory) return fs_error_memory(err);
    Planes veil = fs_planes_over(memory, image->width, image->height, 3);
    VeilView at = fs_view_plan_scene_veil(scene, camera, flash_of(state, view));
    fs_veil_scalar.forward(&at, scene->veil.light.px, &veil, 0, image->height);
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < image->height; y++)
            for (int x = 0; x < image->width; x++) fs_image_at(image, x, y)[c] += fs_planes_row(&veil, c, y)[x];
    free(memory);
    return 0;
}

int fs_as_shot_apply(const AsShot *a, const View *view, Image *composite, FsError *err)
{
    PhotoState state = {{0}};
    ViewPlan plan = {0};
    find_light(a, view->name, &state);
    fs_view_plan_photo(&plan, a->scene, &view->camera, &state, view->exposure_gain, (const float[2]){1, 1}, 0);
    MUST(add_veil(a->scene, &state, view, &view->camera, composite, err));
    return plan.calibrated ? calibrate(&plan.calibration, composite, err) : 0;
}

// T and T + R, their ambient part and the flash's each times its factor.
static void mix(const View *view, const PhotoState *state, const Renders *r, Image *transmitted, Image *whole)
{
    float t = expf(state->x[PHOTO_T]), m = expf(state->x[PHOTO_R]), f = flash_of(state, view);
    const float *T_N = r->layer[RENDER_T_N].px, *T_F = r->layer[RENDER_T_F].px, *I_N = r->layer[RENDER_I_N].px,
                *I_F = r->layer[RENDER_I_F].px;
    for (size_t i = 0; i < fs_image_values(transmitted); i++) {
        float R_N = I_N[i] - T_N[i], R_F = I_F[i] - T_F[i];
        transmitted->px[i] = fmaxf(t * T_N[i] + f * (T_F[i] - T_N[i]), 0);
        whole->px[i] = transmitted->px[i] + fmaxf(m * R_N + f * (R_F - R_N), 0);
    }
}

int fs_as_shot_layers(const AsShot *a, const View *view, const Camera *camera, const Renders *renders, Image layers[2],
                      FsError *err)
{
    PhotoState state = {{0}};
    find_light(a, view->name, &state);
    return fs_as_shot_layers_of(a->scene, &state, view, camera, renders, layers, err);
}

int fs_as_shot_layers_of(const Scene *scene, const PhotoState *state, const View *view, const Camera *camera,
                         const Renders *renders, Image layers[2], FsError *err)
{
    ViewPlan plan = {0};
    fs_view_plan_photo(&plan, scene, camera, state, view->exposure_gain, (const float[2]){1, 1}, 0);
    const Camera *frame = &view->camera; // whose corners the vignetting is told by
    plan.calibration.per_px[0] = plan.calibration.per_px[1] =
        fs_view_plan_per_px(frame) * (float)(frame->fx / camera->fx);
    for (int i = 0; i < 2; i++) MUST(fs_image_new(&layers[i], camera->width, camera->height, 3, err));
    mix(view, state, renders, &layers[0], &layers[1]);
    MUST(add_veil(scene, state, view, camera, &layers[1], err));
    for (int i = 0; i < 2 && plan.calibrated; i++) MUST(calibrate(&plan.calibration, &layers[i], err));
    return 0;
}

#include "render/as_shot.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "engine/view_plan.h"
#include "image/tone.h"

#define MAX_BYTES (64 << 20)

void fs_as_shot_open(AsShot *a, const Scene *scene, const char *out)
{
    json_t *root;
    fs_json_file_read(fs_file_at("%s/clouds/photos.json", out).text, MAX_BYTES, &root, NULL);
    *a = (AsShot){scene, root};
}

void fs_as_shot_close(AsShot *a)
{
    json_decref(a->photos);
    *a = (AsShot){0};
}

static void find_white(const AsShot *a, const char *name, PhotoState *state)
{
    const json_t *photos = json_object_get(a->photos, "photos");
    for (size_t i = 0; i < json_array_size(photos); i++) {
        const json_t *photo = json_array_get(photos, i), *white = json_object_get(photo, "white_balance");
        const char *is = json_string_value(json_object_get(photo, "name"));
        for (size_t c = 0; c < 3 && is && strcmp(is, name) == 0; c++) {
            double w = json_number_value(json_array_get(white, c));
            if (w > 1e-3 && w < 1e3) state->x[PHOTO_WHITE + c] = (float)log(w);
        }
    }
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

int fs_as_shot_apply(const AsShot *a, const View *view, Image *composite, FsError *err)
{
    PhotoState state = {{0}};
    ViewPlan plan = {0};
    find_white(a, view->name, &state);
    fs_view_plan_photo(&plan, a->scene, &view->camera, &state, (const float[2]){1, 1}, 0);
    if (!plan.calibrated) return 0;
    int w = composite->width, h = composite->height;
    size_t floats = fs_planes_floats(w, h, 3);
    float *memory = aligned_alloc(64, 2 * floats * sizeof(float));
    if (!memory) return fs_error_memory(err);
    memset(memory, 0, 2 * floats * sizeof(float));
    Planes I = fs_planes_over(memory, w, h, 3), P = fs_planes_over(memory + floats, w, h, 3);
    copy(composite, &I, false);
    fs_calibration_scalar.forward(&plan.calibration, &I, &P, 0, h);
    copy(composite, &P, true);
    free(memory);
    return 0;
}

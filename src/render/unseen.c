#include "render/unseen.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"
#include "model/scene.h"

enum { BLOCK = 4, CELLS_MOST = 1024, PHOTOS = 5 }; // pixels that are told at once; cells to a side; that are enough

static int damaged(const char *out, FsError *err)
{
    return fs_error_set(err, FS_ERR_INPUT, "%s/clouds/photos.json: \"hidden\" is not a grid of digits; train again",
                        out);
}

static int read_cells(const char *out, const json_t *rows, Hider *hider, FsError *err)
{
    size_t height = json_array_size(rows), width = json_string_length(json_array_get(rows, 0));
    if (!height || !width || height > CELLS_MOST || width > CELLS_MOST) return damaged(out, err);
    hider->hides = malloc(height * width);
    if (!hider->hides) return fs_error_memory(err);
    hider->width = (int)width;
    hider->height = (int)height;
    for (size_t j = 0; j < height; j++) {
        const json_t *row = json_array_get(rows, j);
        if (json_string_length(row) != width) return damaged(out, err);
        for (size_t i = 0; i < width; i++) {
            char digit = json_string_value(row)[i];
            if (digit < '0' || digit > '9') return damaged(out, err);
            hider->hides[j * width + i] = digit >= '5'; // of ninths
        }
    }
    return 0;
}

static const Camera *camera_of(const Dataset *photos, const char *name)
{
    for (int i = 0; i < photos->n && name; i++)
        if (strcmp(photos->view[i].name, name) == 0) return &photos->view[i].camera;
    return NULL;
}

int fs_unseen_open(Unseen *unseen, const char *out, const Dataset *photos, FsError *err)
{
    json_t *root;
    int rc = 0;
    *unseen = (Unseen){0};
    MUST(fs_scene_photos(out, &root, err));
    const json_t *list = json_object_get(root, "photos");
    *unseen = (Unseen){0, calloc(json_array_size(list) + 1, sizeof *unseen->hider)};
    if (!unseen->hider) TRY(fs_error_memory(err));
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *photo = json_array_get(list, i), *rows = json_object_get(photo, "hidden");
        const Camera *camera = camera_of(photos, json_string_value(json_object_get(photo, "name")));
        if (!rows || !camera) continue;
        Hider *hider = &unseen->hider[unseen->n++];
        hider->camera = *camera;
        TRY(read_cells(out, rows, hider, err));
    }
fail:
    json_decref(root);
    if (rc < 0) fs_unseen_close(unseen);
    return rc;
}

void fs_unseen_close(Unseen *unseen)
{
    for (int i = 0; i < unseen->n; i++) free(unseen->hider[i].hides);
    free(unseen->hider);
    *unseen = (Unseen){0};
}

static bool shows(const Hider *hider, const double world[3])
{
    const Camera *c = &hider->camera;
    double pixel[2];
    if (!(fs_camera_sees(c, world, pixel) > 0)) return false;
    int i = (int)(pixel[0] / c->width * hider->width), j = (int)(pixel[1] / c->height * hider->height);
    return !hider->hides[j * hider->width + i];
}

static bool enough_show(const Unseen *unseen, const Camera *camera, double x, double y, double z)
{
    const double p[3] = {(x - camera->cx) / camera->fx * z, (y - camera->cy) / camera->fy * z, z};
    double world[3];
    fs_camera_to_world(camera, p, world);
    int n = 0, enough = unseen->n / 4 < PHOTOS ? (unseen->n + 3) / 4 : PHOTOS;
    for (int i = 0; i < unseen->n && n < enough; i++) n += shows(&unseen->hider[i], world);
    return n >= enough;
}

// 0: nothing is anywhere.
static int usual_depth(const Image *depth, float *usual, FsError *err)
{
    size_t n = 0;
    float *found = malloc(sizeof *found * (fs_image_pixels(depth) + 1));
    if (!found) return fs_error_memory(err);
    for (size_t i = 0; i < fs_image_pixels(depth); i++)
        if (depth->px[i] > 0) found[n++] = depth->px[i];
    fs_order_floats(found, n);
    *usual = n ? found[n / 2] : 0;
    free(found);
    return 0;
}

int fs_unseen_mask(const Unseen *unseen, const Camera *camera, const Image *depth, Image *mask, FsError *err)
{
    float usual = 0;
    MUST(usual_depth(depth, &usual, err));
    MUST(fs_image_new(mask, camera->width, camera->height, 1, err));
    for (int y0 = 0; y0 < camera->height; y0 += BLOCK)
        for (int x0 = 0; x0 < camera->width; x0 += BLOCK) {
            int x1 = x0 + BLOCK < camera->width ? x0 + BLOCK : camera->width;
            int y1 = y0 + BLOCK < camera->height ? y0 + BLOCK : camera->height;
            float z = *fs_image_at(depth, (x0 + x1) / 2, (y0 + y1) / 2);
            z = z > 0 ? z : usual;
            bool guessed = z > 0 && !enough_show(unseen, camera, (x0 + x1) / 2.0, (y0 + y1) / 2.0, (double)z);
            for (int y = y0; y < y1; y++)
                for (int x = x0; x < x1; x++) *fs_image_at(mask, x, y) = guessed;
        }
    return 0;
}

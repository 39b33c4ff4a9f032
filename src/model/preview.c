#include "model/preview.h"

#include "base/file.h"
#include "base/json_file.h"
#include "image/tone.h"

#define EXPOSURE_PHOTOS 8
#define MAX_BYTES (64 << 20)
#define EXPOSURE_EDGE 200

int fs_preview_shrink(const Image *image, int long_edge, Image *smaller, FsError *err)
{
    int width = image->width, height = image->height;
    fs_image_limit(long_edge, &width, &height);
    return fs_image_resize_area(image, width, height, smaller, err);
}

void fs_preview_matrix(const char *out, PreviewLight *light)
{
    json_t *root;
    fs_json_file_read(fs_file_at("%s/ingest.json", out).text, MAX_BYTES, &root, NULL);
    double *m = light->srgb_from_camera;
    light->has_matrix = json_unpack(root, "{s:[FFFFFFFFF!]}", "srgb_from_camera", m, m + 1, m + 2, m + 3, m + 4, m + 5,
                                    m + 6, m + 7, m + 8) == 0;
    json_decref(root);
}

void fs_preview_develop(const PreviewLight *light, float color[3])
{
    const double camera[3] = {(double)color[0], (double)color[1], (double)color[2]};
    for (int c = 0; c < 3; c++) {
        const double *m = light->srgb_from_camera + 3 * c;
        double v = light->has_matrix ? m[0] * camera[0] + m[1] * camera[1] + m[2] * camera[2] : camera[c];
        color[c] = fs_tone_pleasant((float)v, light->exposure);
    }
}

int fs_preview_picture(const Image *linear, int long_edge, const PreviewLight *light, Image *picture, FsError *err)
{
    MUST(fs_preview_shrink(linear, long_edge, picture, err));
    for (size_t i = 0; i < fs_image_pixels(picture) && picture->channels == 3; i++)
        fs_preview_develop(light, picture->px + 3 * i);
    for (size_t i = 0; i < fs_image_values(picture) && picture->channels != 3; i++)
        picture->px[i] = fs_tone_pleasant(picture->px[i], light->exposure);
    return 0;
}

// The i-th of `count` even places among the views with the given flash state; -1 when there are none.
static int nth_of_kind(const Dataset *dataset, bool flash, int i, int count)
{
    int kind = 0;
    for (int v = 0; v < dataset->n; v++) kind += dataset->view[v].flash == flash;
    if (!kind) return -1;
    int wanted = (int)((2 * (int64_t)i + 1) * kind / (2 * count));
    for (int v = 0; v < dataset->n; v++)
        if (dataset->view[v].flash == flash && wanted-- == 0) return v;
    return -1;
}

int fs_preview_choose(const Dataset *dataset, int most, int *chosen)
{
    int n = 0;
    for (int i = 0; i < most; i++) {
        int v = nth_of_kind(dataset, i % 2 == 1, i / 2, (most + 1 - i % 2) / 2);
        bool known = v < 0;
        for (int k = 0; k < n; k++) known |= chosen[k] == v;
        if (!known) chosen[n++] = v;
    }
    return n;
}

int fs_preview_light(const char *out, const Dataset *dataset, PreviewLight *light, FsError *err)
{
    fs_preview_matrix(out, light);
    Image small[EXPOSURE_PHOTOS] = {0}, photo = {0};
    int chosen[EXPOSURE_PHOTOS], n = fs_preview_choose(dataset, EXPOSURE_PHOTOS, chosen), rc = 0;
    if (n == 0) return fs_error_input(err, "%s: no posed photos to take the exposure from", out);
    for (int i = 0; i < n; i++) {
        TRY(fs_dataset_load_view(out, &dataset->view[chosen[i]], &photo, NULL, err));
        TRY(fs_preview_shrink(&photo, EXPOSURE_EDGE, &small[i], err));
        fs_image_free(&photo);
    }
    light->exposure = fs_tone_pleasant_exposure(small, n);
fail:
    fs_image_free(&photo);
    for (int i = 0; i < n; i++) fs_image_free(&small[i]);
    return rc;
}

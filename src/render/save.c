#include "render/save.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/file.h"
#include "image/tone.h"

#define DEPTH_MAX_MM 65535.0

int fs_save_prepare(const char *dir, RenderLayer layer, FsError *err)
{
    char *path = fs_file_path("%s/%s", dir, fs_render_layers[layer].name);
    int rc = path ? fs_file_mkdirs(path, err) : fs_error_memory(err);
    free(path);
    return rc;
}

// World units to 0..1 of a 16-bit PNG in millimetres. Depth beyond its range is left out (0) rather than made up.
static void depth_to_png(Image *image, double metres_per_unit)
{
    size_t n = (size_t)image->width * (size_t)image->height * (size_t)image->channels;
    for (size_t i = 0; i < n; i++) {
        double mm = (double)image->px[i] * metres_per_unit * 1000;
        image->px[i] = mm > 0 && mm <= DEPTH_MAX_MM ? (float)(floor(mm + 0.5) / DEPTH_MAX_MM) : 0;
    }
}

static int save_png(const char *path, RenderLayer layer, const Image *image, double metres_per_unit, FsError *err)
{
    Image encoded = {0};
    int rc, bits = fs_render_layers[layer].channels == 1 ? 16 : 8;
    TRY(fs_image_copy(&encoded, image, err));
    if (fs_render_layers[layer].depth)
        depth_to_png(&encoded, metres_per_unit);
    else if (layer != RENDER_BETA)
        fs_tone_encode_image(&encoded);
    TRY(fs_png_write(path, &encoded, bits, err));
fail:
    fs_image_free(&encoded);
    return rc;
}

int fs_save_layer(const char *dir, RenderLayer layer, const char *view, const Image *image, double metres_per_unit,
                  bool linear, FsError *err)
{
    bool as_float = fs_render_layers[layer].depth ? !(metres_per_unit > 0) : linear;
    bool as_png = !fs_render_layers[layer].depth || metres_per_unit > 0;
    char *png = fs_file_path("%s/%s/%s.png", dir, fs_render_layers[layer].name, view);
    char *tiff = fs_file_path("%s/%s/%s.tif", dir, fs_render_layers[layer].name, view);
    int rc = 0;
    if (!png || !tiff) {
        rc = fs_error_memory(err);
        goto fail;
    }
    if (as_png) TRY(save_png(png, layer, image, metres_per_unit, err));
    if (as_float) TRY(fs_tiff_write_float(tiff, image, err));
    if (!as_png) unlink(png); // of an earlier run, it would contradict
    if (!as_float) unlink(tiff);
fail:
    free(png);
    free(tiff);
    return rc;
}

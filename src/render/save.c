#include "render/save.h"

#include <math.h>

#include "base/file.h"
#include "base/owned.h"
#include "image/tone.h"
#include "model/rendered_from.h"

int fs_save_prepare(const char *dir, RenderLayer layer, FsError *err)
{
    return fs_file_mkdirs(fs_file_at("%s/%s", dir, fs_render_layers[layer].name).text, err);
}

static void drop_if_empty(const char *folder)
{
    FileList list;
    if (fs_file_list(folder, &list, NULL) < 0) return;
    if (list.n == 0) fs_owned_remove(folder);
    fs_file_list_free(&list);
}

static int drop_older(const char *folder, const char *than)
{
    int dropped = 0;
    FileList list;
    if (fs_file_list(folder, &list, NULL) < 0) return 0;
    for (int i = 0; i < list.n; i++) {
        FilePath path = fs_file_at("%s/%s", folder, list.name[i]);
        bool ours = fs_file_has_ext(path.text, "png tif mp4");
        if (ours && (!than || fs_file_is_older(path.text, than))) {
            fs_owned_remove(path.text);
            dropped += !fs_file_exists(path.text);
        }
    }
    fs_file_list_free(&list);
    if (dropped) drop_if_empty(folder);
    return dropped;
}

int fs_save_drop_older(const char *dir, const char *films, const char *than)
{
    int dropped = drop_older(fs_file_at("%s/unseen", dir).text, than) + (films ? drop_older(films, than) : 0);
    for (int l = 0; l < RENDER_LAYERS; l++)
        dropped += drop_older(fs_file_at("%s/%s", dir, fs_render_layers[l].name).text, than);
    if (!than) fs_owned_remove(fs_rendered_from_path(dir).text);
    if (dropped) drop_if_empty(dir);
    return dropped;
}

FilePath fs_save_unseen_path(const char *dir, const char *view)
{
    return fs_file_at("%s/unseen/%s.png", dir, view);
}

int fs_save_unseen(const char *dir, const char *view, const Image *mask, FsError *err)
{
    FilePath path = fs_save_unseen_path(dir, view);
    if (!mask) {
        fs_owned_remove(path.text); // of an earlier run
        return 0;
    }
    MUST(fs_file_mkdirs(fs_file_at("%s/unseen", dir).text, err));
    return fs_png_write(path.text, mask, 8, err);
}

// World units to 0..1 of a 16-bit PNG in millimetres. Depth beyond its range is left out (0) rather than made up.
static void depth_to_png(Image *image, double metres_per_unit)
{
    for (size_t i = 0; i < fs_image_values(image); i++) {
        double mm = (double)image->px[i] * metres_per_unit * 1000;
        image->px[i] = mm > 0 && mm <= SAVE_DEPTH_MM ? (float)(floor(mm + 0.5) / SAVE_DEPTH_MM) : 0;
    }
}

static int save_png(const char *path, RenderLayer layer, const Image *image, SaveScale scale, FsError *err)
{
    Image encoded = {0};
    int rc, bits = fs_render_layers[layer].channels == 1 ? 16 : 8;
    TRY(fs_image_copy(&encoded, image, err));
    for (size_t i = 0; i < fs_image_values(&encoded) && fs_render_layers[layer].channels == 3; i++)
        encoded.px[i] /= scale.white;
    if (fs_render_layers[layer].depth)
        depth_to_png(&encoded, scale.metres_per_unit);
    else if (layer != RENDER_BETA)
        fs_tone_encode_image(&encoded);
    TRY(fs_png_write(path, &encoded, bits, err));
fail:
    fs_image_free(&encoded);
    return rc;
}

int fs_save_layer(const char *dir, RenderLayer layer, const char *view, const Image *image, SaveScale scale,
                  bool linear, FsError *err)
{
    bool as_float = fs_render_layers[layer].depth ? !(scale.metres_per_unit > 0) : linear;
    bool as_png = !fs_render_layers[layer].depth || scale.metres_per_unit > 0;
    FilePath png = fs_file_at("%s/%s/%s.png", dir, fs_render_layers[layer].name, view);
    FilePath tiff = fs_file_at("%s/%s/%s.tif", dir, fs_render_layers[layer].name, view);
    if (as_png) MUST(save_png(png.text, layer, image, scale, err));
    if (as_float) MUST(fs_tiff_write_float(tiff.text, image, err));
    if (!as_png) fs_owned_remove(png.text); // of an earlier run, it would contradict
    if (!as_float) fs_owned_remove(tiff.text);
    return 0;
}

#include "report/page.h"

#include <math.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"
#include "image/blur.h"
#include "image/colormap.h"
#include "image/tone.h"
#include "model/preview.h"

#define EDGE 1000
#define QUALITY 88
#define SOFT 1.5f // sigma, cells

const PreviewInfo fs_previews[PREVIEWS] = {
    [PREVIEW_PHOTO] = {"photo", {0}, "Photo", "as taken, both scenes mixed"},
    [PREVIEW_COMPOSITE] = {"I",
                           {RENDER_I_N, RENDER_I_F},
                           "Model of the photo",
                           "transmitted and reflected put together again"},
    [PREVIEW_T_N] = {"T_N", {RENDER_T_N, RENDER_T_N}, "Behind the glass", "the transmitted scene in ambient light"},
    [PREVIEW_T_F] = {"T_F",
                     {RENDER_T_F, RENDER_T_F},
                     "Behind the glass, with flash",
                     "the transmitted scene lit by the flash too"},
    [PREVIEW_R] = {"R", {RENDER_R, RENDER_R}, "Mirrored in the glass", "the reflected scene"},
    [PREVIEW_DEPTH] = {"depth",
                       {RENDER_DEPTH_T, RENDER_DEPTH_T},
                       "Depth behind the glass",
                       "near is bright, far is dark, grey is empty"},
};

// What the pictures share.
typedef struct Show {
    const FsProject *project;
    const Dataset *dataset;
    PreviewSet *set;
    PreviewLight light;
    float white, nearest, farthest; // white: of the renders
} Show;

// Reads the first of <out>/renders/<layer>/<view>.{png,tif} that exists; image stays empty when there is none.
static int read_render(const Show *show, RenderLayer layer, const char *view, Image *image, FsError *err)
{
    FilePath png = fs_file_at("%s/renders/%s/%s.png", show->project->out, fs_render_layers[layer].name, view);
    FilePath tiff = fs_file_at("%s/renders/%s/%s.tif", show->project->out, fs_render_layers[layer].name, view);
    if (fs_file_exists(png.text)) return fs_png_read(png.text, image, err);
    return fs_file_exists(tiff.text) ? fs_tiff_read(tiff.text, image, err) : 0;
}

// The display picture of one view; empty when its source is not there.
static int make_picture(const Show *show, Preview preview, const View *view, Image *picture, FsError *err)
{
    Image source = {0}, full = {0};
    int rc;
    if (preview == PREVIEW_PHOTO)
        TRY(fs_dataset_load_view(show->project->out, view, &source, NULL, err));
    else
        TRY(read_render(show, fs_previews[preview].layer[view->flash], view->name, &source, err));
    if (!source.px) goto fail;
    if (preview == PREVIEW_DEPTH) {
        TRY(fs_colormap_depth(&source, show->nearest, show->farthest, &full, err));
        TRY(fs_preview_shrink(&full, EDGE, picture, err));
    } else {
        bool photo = preview == PREVIEW_PHOTO;
        if (!photo) fs_tone_decode_image(&source);
        PreviewLight light = show->light;
        light.exposure *= photo ? 1 : show->white;
        TRY(fs_preview_picture(&source, EDGE, &light, picture, err));
    }
fail:
    fs_image_free(&source);
    fs_image_free(&full);
    return rc;
}

static int write_picture(const Show *show, int i, Preview preview, FsError *err)
{
    PreviewSet *set = show->set;
    const View *view = &show->dataset->view[set->view[i]];
    Image picture = {0};
    FsError why = {0};
    if (make_picture(show, preview, view, &picture, &why) < 0) {
        fs_image_free(&picture);
        if (why.code == FS_ERR_MEMORY) return fs_error_memory(err);
        fs_log_warn(&show->project->log, "report: left out: %s", why.message);
        return 0;
    }
    if (!picture.px) return 0;
    FilePath path = fs_file_at("%s/report/%d_%s.jpg", show->project->out, i + 1, fs_previews[preview].key);
    int rc = fs_jpeg_write(path.text, &picture, QUALITY, NULL, err);
    set->has[i][preview] = rc == 0;
    if (rc == 0 && !set->width) {
        set->width = picture.width;
        set->height = picture.height;
    }
    fs_image_free(&picture);
    return rc;
}

// The range of depth colours over all the views shown.
static void find_range(Show *show)
{
    show->nearest = INFINITY;
    for (int i = 0; i < show->set->n; i++) {
        Image depth = {0};
        float low, high;
        const View *view = &show->dataset->view[show->set->view[i]];
        if (read_render(show, RENDER_DEPTH_T, view->name, &depth, NULL) == 0 && depth.px &&
            fs_colormap_range(&depth, 0.01, 0.99, &low, &high)) {
            show->nearest = fminf(show->nearest, low);
            show->farthest = fmaxf(show->farthest, high);
        }
        fs_image_free(&depth);
    }
}

// Of the dirt on the glass, where there is some: in its own exposure, since it is dark, and softer than it was found.
static int write_veil(const Show *show, FsError *err)
{
    FilePath from = fs_file_at("%s/clouds/veil.tif", show->project->out);
    Image veil = {0}, soft = {0}, picture = {0};
    FsError why = {0};
    int rc = 0;
    if (!fs_file_exists(from.text)) return 0;
    if (fs_tiff_read(from.text, &veil, &why) < 0) {
        if (why.code == FS_ERR_MEMORY) return fs_error_memory(err);
        fs_log_warn(&show->project->log, "report: left out: %s", why.message);
        return 0;
    }
    if (veil.channels != 1) goto fail;                                         // not ours
    TRY(fs_image_new(&soft, veil.width, veil.height, 2 * veil.channels, err)); // and room to blur in
    fs_blur_image(&veil, soft.px + fs_image_values(&veil), soft.px, SOFT);
    memcpy(veil.px, soft.px, sizeof *veil.px * fs_image_values(&veil));
    PreviewLight light = {.exposure = fs_tone_pleasant_exposure(&veil, 1)};
    TRY(fs_preview_picture(&veil, EDGE, &light, &picture, err));
    TRY(fs_jpeg_write(fs_file_at("%s/report/veil.jpg", show->project->out).text, &picture, QUALITY, NULL, err));
fail:
    fs_image_free(&veil);
    fs_image_free(&soft);
    fs_image_free(&picture);
    return rc;
}

int fs_previews_write(const FsProject *project, const Dataset *dataset, PreviewSet *set, FsError *err)
{
    *set = (PreviewSet){0};
    set->n = fs_preview_choose(dataset, FS_PREVIEWS_VIEWS, set->view);
    Show show = {.project = project, .dataset = dataset, .set = set, .light.exposure = 1};
    show.white = fs_learned_white(project->out);
    FsError why = {0};
    FilePath dir = fs_file_at("%s/report", project->out);
    // From here on to the page's end, some seconds: the page that is there has lost its pictures.
    if (fs_log_cancelled(&project->log)) return fs_error_set(err, FS_ERR_CANCELLED, "report: stopped");
    fs_owned_remove(dir.text);
    MUST(fs_file_mkdirs(dir.text, err));
    if (fs_preview_light(project->out, dataset, &show.light, &why) == FS_ERR_MEMORY) MUST(fs_error_memory(err));
    if (why.code) fs_log_warn(&project->log, "report: no exposure for the pictures: %s", why.message);
    set->light = show.light;
    find_range(&show);
    for (int i = 0; i < set->n; i++)
        for (int p = 0; p < PREVIEWS; p++) MUST(write_picture(&show, i, (Preview)p, err));
    return write_veil(&show, err);
}

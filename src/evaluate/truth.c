// Truth folders: which views a layer has, and reading pictures as pairs of one size.
#include "evaluate/truth.h"

#include <stdlib.h>
#include <string.h>

#include "image/photo.h"
#include "image/tone.h"

static bool wanted(const Dataset *cameras, const char *name, const char *which)
{
    if (strcmp(which, "all") == 0) return true;
    int at = fs_dataset_find(cameras, name);
    bool held_out = at >= 0 && cameras->view[at].held_out;
    return held_out == (strcmp(which, "held_out") == 0);
}

int fs_truth_list(const char *truth, const char *layer, const Dataset *cameras, const char *which, TruthViews *views,
                  FsError *err)
{
    *views = (TruthViews){0};
    FileList list = {0};
    int rc = 0;
    FilePath dir = fs_file_at("%s/%s", truth, layer);
    if (!fs_file_is_dir(dir.text)) return 0;
    TRY(fs_file_list(dir.text, &list, err));
    views->view = calloc((size_t)list.n + 1, sizeof *views->view);
    if (!views->view) TRY(fs_error_memory(err));
    for (int i = 0; i < list.n; i++) {
        TruthView *view = &views->view[views->n];
        char *stem = fs_file_stem(list.name[i]);
        snprintf(view->name, sizeof view->name, "%s", stem ? stem : "");
        free(stem);
        if (!fs_file_has_ext(list.name[i], "png jpg jpeg") || !wanted(cameras, view->name, which)) continue;
        view->path = fs_file_at("%s/%s", dir.text, list.name[i]);
        views->n++;
    }
fail:
    if (rc < 0) fs_truth_free(views);
    fs_file_list_free(&list);
    return rc;
}

void fs_truth_free(TruthViews *views)
{
    free(views->view);
    *views = (TruthViews){0};
}

bool fs_truth_find(const char *dir, const char *layer, const char *view, const char *extensions, FilePath *path)
{
    for (const char *e = extensions; *e;) {
        size_t n = strcspn(e, "|");
        *path = fs_file_at("%s/%s/%s.%.*s", dir, layer, view, (int)n, e);
        if (fs_file_exists(path->text)) return true;
        e += n + (e[n] == '|');
    }
    return false;
}

static int read_rgb(const char *path, Image *image, FsError *err)
{
    int rc = fs_photo_read_stored(path, image, err);
    if (rc < 0 || image->channels == 3) return rc;
    Image rgb;
    rc = fs_image_new(&rgb, image->width, image->height, 3, err);
    size_t n = rc < 0 ? 0 : fs_image_pixels(image);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++) rgb.px[3 * i + c] = image->px[i * (size_t)image->channels];
    fs_image_free(image);
    if (rc == 0) *image = rgb;
    return rc;
}

static int shrink(Image *image, const Image *to, FsError *err)
{
    Image small;
    fs_tone_decode_image(image);
    MUST(fs_image_resize_area(image, to->width, to->height, &small, err));
    fs_image_free(image);
    *image = small;
    fs_tone_encode_image(image);
    return 0;
}

int fs_truth_same_size(Image *a, Image *b, const char *name, FsError *err)
{
    long long aw = a->width, ah = a->height, bw = b->width, bh = b->height;
    if (llabs(aw * bh - bw * ah) > (aw > ah ? aw : ah))
        return fs_error_input(err, "%s: %lld x %lld pixels, other proportions than the truth's %lld x %lld", name, bw,
                              bh, aw, ah);
    if (aw > bw) return shrink(a, b, err);
    if (bw > aw) return shrink(b, a, err);
    if (ah != bh) return ah > bh ? shrink(a, b, err) : shrink(b, a, err);
    return 0;
}

int fs_truth_read_pair(const char *truth, const char *estimate, Image *a, Image *b, FsError *err)
{
    *a = *b = (Image){0};
    int rc;
    TRY(read_rgb(truth, a, err));
    TRY(read_rgb(estimate, b, err));
    TRY(fs_truth_same_size(a, b, estimate, err));
fail:
    if (rc < 0) {
        fs_image_free(a);
        fs_image_free(b);
    }
    return rc;
}

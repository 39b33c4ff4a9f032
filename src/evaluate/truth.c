// Truth folders: which views a layer has, and reading pictures as pairs of one size.
#include "evaluate/truth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/photo.h"
#include "image/tone.h"

#define SAME_SHAPE 0.04 // proportions may differ by so much

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

Encoding fs_truth_encoding(const char *name)
{
    return strcmp(name, "srgb") == 0 ? ENCODING_SRGB : strcmp(name, "linear") == 0 ? ENCODING_LINEAR : ENCODING_GAMMA;
}

// Whether a file's name is that of the view, or that and more.
static bool begins_with(const char *stem, const char *view)
{
    size_t n = strlen(view);
    return strncmp(stem, view, n) == 0 && (!stem[n] || strchr("_-. ", stem[n]));
}

// IMG_1_flash_out is what came of IMG_1_flash where there is one, not of IMG_1.
static bool is_of_another(const char *stem, const char *view, const Dataset *cameras)
{
    for (int i = 0; i < cameras->n; i++)
        if (strlen(cameras->view[i].name) > strlen(view) && begins_with(stem, cameras->view[i].name)) return true;
    return false;
}

int fs_truth_find_estimate(const char *dir, const char *layer, const Dataset *cameras, const char *view, FilePath *path)
{
    FilePath folder = fs_file_at("%s/%s", dir, layer);
    FileList list = {0};
    int found = 0, exact = 0;
    size_t n = strlen(view);
    if (fs_file_list(folder.text, &list, NULL) < 0) return 0;
    for (int i = 0; i < list.n; i++) {
        char *stem = fs_photo_kind(list.name[i]) > PHOTO_NPY ? fs_file_stem(list.name[i]) : NULL;
        bool begins = stem && begins_with(stem, view) && !is_of_another(stem, view, cameras),
             whole = begins && !stem[n];
        if (whole || (begins && !exact)) *path = fs_file_at("%s/%s", folder.text, list.name[i]);
        found += begins;
        exact += whole;
        free(stem);
    }
    fs_file_list_free(&list);
    return exact ? exact : found;
}

static bool all_numbers(const Image *image)
{
    for (size_t i = 0; i < fs_image_values(image); i++)
        if (!isfinite(image->px[i])) return false;
    return true;
}

static int read_rgb(const char *path, Image *image, FsError *err)
{
    int rc = fs_photo_read_stored(path, image, err);
    if (rc == 0 && !all_numbers(image))
        rc = fs_error_input(err, "%s: some of its values are no finite numbers, which no error can be measured of",
                            path);
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

static int shrink(Image *image, int width, int height, FsError *err)
{
    Image small;
    if (image->width == width && image->height == height) return 0;
    fs_tone_decode_image(image);
    MUST(fs_image_resize_area(image, width, height, &small, err));
    fs_image_free(image);
    *image = small;
    fs_tone_encode_image(image);
    return 0;
}

int fs_truth_same_shape(const Image *a, const Image *b, const char *name, FsError *err)
{
    long long aw = a->width, ah = a->height, bw = b->width, bh = b->height;
    if ((double)llabs(aw * bh - bw * ah) <= fmax(SAME_SHAPE * (double)aw * (double)bh, (double)(aw > ah ? aw : ah)))
        return 0;
    return fs_error_input(err, "%s: %lld x %lld pixels, other proportions than the truth's %lld x %lld", name, bw, bh,
                          aw, ah);
}

int fs_truth_same_size(Image *a, Image *b, const char *name, FsError *err)
{
    MUST(fs_truth_same_shape(a, b, name, err));
    int width = a->width < b->width ? a->width : b->width, height = a->height < b->height ? a->height : b->height;
    MUST(shrink(a, width, height, err));
    return shrink(b, width, height, err);
}

// To ours; more than white becomes white.
static void recode(Image *image, Encoding from)
{
    for (size_t i = 0; i < fs_image_values(image) && from != ENCODING_GAMMA; i++) {
        float v = image->px[i] < 1 ? image->px[i] : 1;
        image->px[i] = fs_tone_encode(from == ENCODING_SRGB ? fs_tone_srgb_decode(v) : v);
    }
}

int fs_truth_read_pair(const char *truth, const char *estimate, Encoding encoding, Image *a, Image *b, FsError *err)
{
    *a = *b = (Image){0};
    int rc;
    TRY(read_rgb(truth, a, err));
    TRY(read_rgb(estimate, b, err));
    recode(b, encoding);
    TRY(fs_truth_same_size(a, b, estimate, err));
fail:
    if (rc < 0) {
        fs_image_free(a);
        fs_image_free(b);
    }
    return rc;
}

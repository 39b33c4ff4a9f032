#include "ingest/photo_mask.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// One channel, of the photo's size.
static int read_mask(const char *path, const Image *photo, Image *mask, FsError *err)
{
    Image whole = {0};
    int rc;
    TRY(fs_png_read(path, &whole, err));
    for (size_t i = 0; i < fs_image_pixels(&whole) && whole.channels > 1; i++)
        whole.px[i] = whole.px[i * (size_t)whole.channels];
    whole.channels = 1;
    double shape = (double)whole.width / whole.height, wanted = (double)photo->width / photo->height;
    if (fabs(shape / wanted - 1) > 0.02 || whole.width < photo->width || whole.height < photo->height)
        TRY(fs_error_input(err, "%s: %d x %d pixels, expected the size of its photo as one sees it (upright)", path,
                           whole.width, whole.height));
    TRY(fs_image_resize_area(&whole, photo->width, photo->height, mask, err));
fail:
    fs_image_free(&whole);
    return rc;
}

int fs_photo_mask_apply(const char *path, Image *photo, Image *trusted, Image *mask, FsError *err)
{
    Image read = {0};
    size_t left = 0;
    MUST(read_mask(path, photo, &read, err));
    for (size_t i = 0; i < fs_image_pixels(&read); i++) {
        read.px[i] = read.px[i] > 0.999f;
        left += read.px[i] != 0;
        if (read.px[i] != 0) continue;
        for (int c = 0; c < photo->channels; c++) photo->px[i * (size_t)photo->channels + (size_t)c] = 0;
        if (trusted) trusted->px[i] = 0;
    }
    if (!left) {
        fs_image_free(&read);
        return fs_error_input(err, "%s: leaves nothing of its photo: only what is not to be used is black", path);
    }
    if (mask) {
        fs_image_free(mask);
        *mask = read;
        return 0;
    }
    fs_image_free(&read);
    return 0;
}

// Masks in a folder that are not among those in use.
static int count_unused(const char *folder, char *const *used, int n, FilePath *example)
{
    FileList list;
    int unused = 0;
    if (fs_file_list(folder, &list, NULL) < 0) return 0;
    for (int k = 0; k < list.n; k++) {
        FilePath path = fs_file_at("%s/%s", folder, list.name[k]);
        bool is_used = !fs_file_has_ext(path.text, "png");
        for (int i = 0; i < n && !is_used; i++) is_used = used[i] && strcmp(used[i], path.text) == 0;
        if (!is_used) unused++, *example = fs_file_at("%s", list.name[k]);
    }
    fs_file_list_free(&list);
    return unused;
}

// A mask of no photo is one that somebody drew in vain.
static int warn_of_unused(const Photos *photos, const Log *log, FsError *err)
{
    FilePath path, example;
    int n = photos->n, rc = 0;
    char **used = calloc((size_t)n + 1, sizeof *used);
    for (int i = 0; i < n && used; i++)
        if (fs_photos_mask(photos, &photos->photo[i], &path)) used[i] = strdup(path.text);
    int unused = used ? count_unused(photos->masks, used, n, &example) : 0;
    for (int i = 0; i < n && used; i++) {
        const PhotoFile *photo = &photos->photo[i];
        path = fs_photos_mask_folder(photos, photo);
        bool seen = strcmp(path.text, photos->masks) == 0;
        for (int k = 0; k < i && !seen; k++) seen = fs_photos_same_folder(photo, &photos->photo[k]);
        if (!seen) unused += count_unused(path.text, used, n, &example);
    }
    if (unused)
        fs_log_warn(log, "%s: %d masks are of no photo, e.g. %s: name them like %s.png", photos->masks, unused,
                    example.text, photos->photo[0].path);
    if (!used) rc = fs_error_memory(err);
    for (int i = 0; i < n && used; i++) free(used[i]);
    free(used);
    return rc;
}

int fs_photo_mask_check(const Photos *photos, const Log *log, FsError *err)
{
    FilePath path;
    int n = 0;
    if (!photos->masks || !*photos->masks) return 0;
    for (int i = 0; i < photos->n; i++) n += fs_photos_mask(photos, &photos->photo[i], &path);
    if (n == 0)
        return fs_error_input(err,
                              "%s: no mask of these photos; expected PNG files like %s.png, black where the photo is "
                              "not to be used",
                              photos->masks, photos->photo[0].path);
    fs_log_info(log, "ingest: %d of %d photos have a mask", n, photos->n);
    return warn_of_unused(photos, log, err);
}

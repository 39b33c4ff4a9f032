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

// A mask of no photo is one that somebody drew in vain.
static int warn_of_unused(const Photos *photos, const Log *log, FsError *err)
{
    FileList list;
    FilePath path;
    int unused = 0;
    const char *example = "";
    MUST(fs_file_list(photos->masks, &list, err));
    bool *used = calloc((size_t)list.n + 1, sizeof *used);
    for (int i = 0; i < photos->n && used; i++) {
        if (!fs_photos_mask(photos, &photos->photo[i], &path)) continue;
        for (int k = 0; k < list.n; k++) used[k] |= strcmp(list.name[k], fs_file_name(path.text)) == 0;
    }
    for (int k = 0; k < list.n && used; k++)
        if (!used[k] && fs_file_has_ext(list.name[k], "png")) unused++, example = list.name[k];
    if (unused)
        fs_log_warn(log, "%s: %d masks are of no photo, e.g. %s: name them like %s.png", photos->masks, unused, example,
                    photos->photo[0].path);
    fs_file_list_free(&list);
    bool looked = used;
    free(used);
    return looked ? 0 : fs_error_memory(err);
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

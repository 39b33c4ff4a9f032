#include "poses/capture.h"

#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/order.h"
#include "image/image.h"
#include "model/project.h"

#define MAX_PHOTOS 46000 // their pairs are numbered (fs_match_pair)

void fs_capture_free(Capture *capture)
{
    for (int i = 0; i < capture->n; i++) {
        free(capture->photo[i].name);
        free(capture->photo[i].picture);
        free(capture->photo[i].file);
    }
    free(capture->photo);
    free(capture->pictures);
    *capture = (Capture){0};
}

int fs_capture_find(const Capture *capture, const char *name)
{
    for (int i = 0; i < capture->n; i++)
        if (strcmp(capture->photo[i].name, name) == 0) return i;
    return -1;
}

static double gain_of(const json_t *object, const char *key)
{
    const double factor = json_number_value(json_object_get(object, key));
    return factor > 1e-3 && factor < 1e3 ? factor : 1;
}

// What an earlier ingest did not write is not told.
static int read_file(const json_t *object, Photo *photo, FsError *err)
{
    const char *file = json_string_value(json_object_get(object, "file"));
    json_int_t turned = json_integer_value(json_object_get(object, "orientation"));
    json_int_t w = json_integer_value(json_object_get(object, "orig_width"));
    json_int_t h = json_integer_value(json_object_get(object, "orig_height"));
    bool sized = w > 0 && h > 0 && w <= FS_IMAGE_MAX_SIDE && h <= FS_IMAGE_MAX_SIDE;
    photo->orientation = turned >= 1 && turned <= 8 ? (int)turned : 1;
    photo->orig_width = sized ? (int)w : 0;
    photo->orig_height = sized ? (int)h : 0;
    photo->file = strdup(file ? file : "");
    return photo->file ? 0 : fs_error_memory(err);
}

static int read_photo(const json_t *object, Photo *photo, const char *path, FsError *err)
{
    const char *name = json_string_value(json_object_get(object, "name"));
    json_int_t w = json_integer_value(json_object_get(object, "width"));
    json_int_t h = json_integer_value(json_object_get(object, "height"));
    if (!name || !*name || strchr(name, '/') || w < 1 || h < 1 || w > FS_IMAGE_MAX_SIDE || h > FS_IMAGE_MAX_SIDE)
        return fs_error_input(err, "%s: a photo without name, width or height; rerun the stage ingest with --force",
                              path);
    double focal = json_number_value(json_object_get(object, "focal_px"));
    double mm = json_number_value(json_object_get(object, "focal_mm"));
    const char *quality = json_string_value(json_object_get(object, "quality"));
    *photo = (Photo){.flash_gain = gain_of(object, "flash_gain"),
                     .exposure_gain = gain_of(object, "exposure_gain"),
                     .brightness = fmax(json_number_value(json_object_get(object, "brightness")), 0),
                     .sharpness = fmax(json_number_value(json_object_get(object, "sharpness")), 0),
                     .flash = json_is_true(json_object_get(object, "flash")),
                     .encoded = quality && strcmp(quality, "reduced") == 0,
                     .width = (int)w,
                     .height = (int)h,
                     .focal_px = focal > 0 && isfinite(focal) ? focal : 0,
                     .focal_mm = mm > 0 && isfinite(mm) ? mm : 0};
    photo->name = strdup(name);
    photo->picture = fs_file_path("%s.png", name);
    return photo->name && photo->picture ? read_file(object, photo, err) : fs_error_memory(err);
}

static int read_photos(const char *path, Capture *capture, FsError *err)
{
    json_t *root;
    int rc = 0;
    TRY(fs_json_file_read(path, (size_t)256 << 20, &root, err));
    const json_t *photos = json_object_get(root, "photos");
    size_t n = json_array_size(photos);
    if (n < 1 || n > MAX_PHOTOS)
        TRY(fs_error_input(err, "%s: not what the stage ingest writes; rerun it with --force", path));
    capture->photo = calloc(n, sizeof *capture->photo);
    if (!capture->photo) TRY(fs_error_memory(err));
    for (size_t i = 0; i < n; i++) {
        capture->n = (int)i + 1;
        TRY(read_photo(json_array_get(photos, i), &capture->photo[i], path, err));
    }
    fs_order_named(capture->photo, n, sizeof *capture->photo);
fail:
    json_decref(root);
    return rc;
}

// Size of a PNG out of its header, without decoding it.
static int picture_size(const char *folder, Photo *photo, FsError *err)
{
    FilePath path = fs_file_at("%s/%s", folder, photo->picture);
    FILE *f;
    fs_file_open(path.text, &f, NULL);
    unsigned char head[24] = {0};
    size_t got = f ? fread(head, 1, sizeof head, f) : 0;
    if (f) fclose(f);
    photo->picture_width = (int)((unsigned)head[16] << 24 | head[17] << 16 | head[18] << 8 | head[19]);
    photo->picture_height = (int)((unsigned)head[20] << 24 | head[21] << 16 | head[22] << 8 | head[23]);
    if (got < sizeof head || png_sig_cmp(head, 0, 8) != 0 || photo->picture_width < 1 || photo->picture_height < 1 ||
        photo->picture_width > FS_IMAGE_MAX_SIDE || photo->picture_height > FS_IMAGE_MAX_SIDE)
        return fs_error_input(err, "%s: not a PNG; rerun the stage ingest with --force", path.text);
    return 0;
}

int fs_capture_read(const char *out, Capture *capture, FsError *err)
{
    *capture = (Capture){0};
    int rc = 0;
    FilePath path = fs_file_at("%s/ingest.json", out);
    capture->pictures = fs_file_path("%s/linear/features", out);
    if (!capture->pictures) TRY(fs_error_memory(err));
    if (!fs_file_exists(path.text)) TRY(fs_project_missing(out, FS_STAGE_INGEST, "ingest.json", err));
    rc = read_photos(path.text, capture, err);
    TRY(fs_error_then(rc, "remove it, and `flashsplat ingest PHOTOS -o OUT --force` makes it again", err));
    for (int i = 0; i < capture->n; i++) TRY(picture_size(capture->pictures, &capture->photo[i], err));
fail:
    if (rc < 0) fs_capture_free(capture);
    return rc;
}

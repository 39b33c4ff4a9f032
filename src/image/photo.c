// Photos: RAW as LibRaw and the demosaic give them, the others linearised where they hold display values.
#include "image/photo.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/file.h"
#include "image/raw.h"
#include "image/tone.h"

#define CLIP_LINEAR 0.98f  // of white
#define CLIP_ENCODED 0.99f // of 255: a camera's curve is flat long before

int fs_photo_kind(const char *path)
{
    static const struct {
        PhotoKind kind;
        const char *extensions;
    } known[] = {{PHOTO_RAW, "dng cr2 cr3 crw nef nrw arw sr2 srf raf orf rw2 pef srw x3f 3fr fff iiq erf mrw kdc dcr "
                             "mef mos rwl gpr"},
                 {PHOTO_JPEG, "jpg jpeg jpe"},
                 {PHOTO_PNG, "png"},
                 {PHOTO_TIFF, "tif tiff"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        for (const char *at = known[i].extensions; *at; at += strspn(at, " ")) {
            char extension[8];
            size_t n = strcspn(at, " ");
            snprintf(extension, sizeof extension, "%.*s", (int)n, at);
            if (fs_file_has_ext(path, extension)) return (int)known[i].kind;
            at += n;
        }
    return -1;
}

static bool is_raw(const char *path)
{
    int kind = fs_photo_kind(path);
    return kind < 0 || kind == PHOTO_RAW;
}

int fs_photo_read_info(const char *path, ExifInfo *exif, double white_balance[3], FsError *err)
{
    RawInfo raw;
    for (int c = 0; c < 3; c++) white_balance[c] = 0;
    MUST(fs_exif_read(path, exif, err));
    if (!is_raw(path)) return 0;
    MUST(fs_raw_read_info(path, &raw, err));
    bool known = raw.white_balance[0] > 0;
    for (int c = 0; c < 3; c++) white_balance[c] = known ? raw.white_balance[c] : raw.daylight[c];
    exif->orientation = raw.orientation;
    if (exif->exposure_s == 0) exif->exposure_s = raw.exposure_s;
    if (exif->iso == 0) exif->iso = raw.iso;
    if (exif->f_number == 0) exif->f_number = raw.f_number;
    if (exif->focal_mm == 0) exif->focal_mm = raw.focal_mm;
    return 0;
}

int fs_photo_read_stored(const char *path, Image *image, FsError *err)
{
    int kind = fs_photo_kind(path);
    return (kind == PHOTO_PNG ? fs_png_read : kind == PHOTO_TIFF ? fs_tiff_read : fs_jpeg_read)(path, image, err);
}

static int read_display(const char *path, Image *image, bool *encoded, FsError *err)
{
    bool linear = false;
    int kind = fs_photo_kind(path);
    if (kind == PHOTO_PNG) MUST(fs_png_is_linear(path, &linear, err));
    if (kind == PHOTO_TIFF) MUST(fs_tiff_is_linear(path, &linear, err));
    MUST(fs_photo_read_stored(path, image, err));
    *encoded = !linear;
    return 0;
}

// Three channels in linear light, and where a channel was clipped. NaN and infinity count as clipped.
static int linearise(const Image *image, bool encoded, Image *rgb, Image *clipped, FsError *err)
{
    MUST(fs_image_new(rgb, image->width, image->height, 3, err));
    MUST(fs_image_new(clipped, image->width, image->height, 1, err));
    float limit = encoded ? CLIP_ENCODED : CLIP_LINEAR;
    for (size_t i = 0; i < fs_image_pixels(image); i++)
        for (size_t c = 0; c < 3; c++) {
            float v = image->channels == 3 ? image->px[3 * i + c] : image->px[i];
            if (!(v < limit) || !isfinite(v)) clipped->px[i] = 1;
            if (!isfinite(v)) v = 1;
            rgb->px[3 * i + c] = encoded ? fs_tone_srgb_decode(v) : v;
        }
    return 0;
}

int fs_photo_read(const char *path, const double white_balance[3], Image *rgb, Image *clipped, bool *encoded,
                  FsError *err)
{
    *encoded = false;
    if (is_raw(path)) return fs_raw_read(path, white_balance, false, rgb, clipped, err);
    Image image = {0};
    int rc = read_display(path, &image, encoded, err);
    if (rc == 0) rc = linearise(&image, *encoded, rgb, clipped, err);
    fs_image_free(&image);
    if (rc < 0) {
        fs_image_free(rgb);
        fs_image_free(clipped);
    }
    return rc;
}

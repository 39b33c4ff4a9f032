// Photos: RAW as LibRaw and the demosaic give them, the others linearised where they hold display values.
#include "image/photo.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/raw.h"
#include "image/tone.h"

#define CLIP_LINEAR 0.98f  // of white
#define CLIP_ENCODED 0.99f // of 255: a camera's curve is flat long before
#define FLOATS_BYTES 14    // a pixel, of what is not RAW, as it is read
#define UNKNOWN_PIXELS 24e6

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
        if (fs_file_has_ext(path, known[i].extensions)) return (int)known[i].kind;
    return -1;
}

PhotoKind fs_photo_kind_inside(const char *path)
{
    unsigned char head[12] = {0};
    int kind = fs_photo_kind(path);
    FILE *f = fopen(path, "rb");
    size_t n = f ? fread(head, 1, sizeof head, f) : 0;
    if (f) fclose(f);
    if (n < sizeof head) return kind < 0 ? PHOTO_RAW : (PhotoKind)kind;
    if (memcmp(head, "\xff\xd8\xff", 3) == 0) return PHOTO_JPEG;
    if (memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) return PHOTO_PNG;
    bool tiff = memcmp(head, "II*\0", 4) == 0 || memcmp(head, "MM\0*", 4) == 0; // or RAW
    if (tiff && kind > PHOTO_RAW) return PHOTO_TIFF;
    return kind < 0 ? PHOTO_RAW : (PhotoKind)kind;
}

int fs_photo_read_info(const char *path, ExifInfo *exif, double white_balance[3], double *memory, FsError *err)
{
    RawInfo raw;
    for (int c = 0; c < 3; c++) white_balance[c] = 0;
    MUST(fs_exif_read(path, exif, err));
    double stored = (double)exif->width * exif->height;
    if (memory) *memory = FLOATS_BYTES * (stored > 0 ? stored : UNKNOWN_PIXELS);
    if (fs_photo_kind_inside(path) != PHOTO_RAW) return 0;
    MUST(fs_raw_read_info(path, &raw, err));
    bool known = raw.white_balance[0] > 0;
    for (int c = 0; c < 3; c++) white_balance[c] = known ? raw.white_balance[c] : raw.daylight[c];
    if (memory) *memory = raw.memory;
    exif->orientation = raw.orientation;
    exif->width = raw.width;
    exif->height = raw.height;
    if (exif->flash < 0) exif->flash = raw.flash;
    if (!*exif->make && !*exif->model) {
        memcpy(exif->make, raw.make, sizeof exif->make);
        memcpy(exif->model, raw.model, sizeof exif->model);
    }
    if (exif->exposure_s == 0) exif->exposure_s = raw.exposure_s;
    if (exif->iso == 0) exif->iso = raw.iso;
    if (exif->f_number == 0) exif->f_number = raw.f_number;
    if (exif->focal_mm == 0) exif->focal_mm = raw.focal_mm;
    return 0;
}

int fs_photo_read_stored(const char *path, Image *image, FsError *err)
{
    PhotoKind kind = fs_photo_kind_inside(path);
    return (kind == PHOTO_PNG ? fs_png_read : kind == PHOTO_TIFF ? fs_tiff_read : fs_jpeg_read)(path, image, err);
}

static int read_display(const char *path, Image *image, bool *encoded, FsError *err)
{
    bool linear = false;
    PhotoKind kind = fs_photo_kind_inside(path);
    if (kind == PHOTO_PNG) MUST(fs_png_is_linear(path, &linear, err));
    if (kind == PHOTO_TIFF) MUST(fs_tiff_is_linear(path, &linear, err));
    MUST(fs_photo_read_stored(path, image, err));
    *encoded = !linear;
    return 0;
}

// In linear light, and where a channel was clipped. NaN and infinity count as clipped.
static int linearise(const Image *image, bool encoded, PhotoSizes *sizes, FsError *err)
{
    size_t width = (size_t)image->width, channels = (size_t)image->channels;
    float limit = encoded ? CLIP_ENCODED : CLIP_LINEAR, *clipped = malloc(width * 4 * sizeof *clipped);
    float *rgb = clipped + width;
    int rc = clipped ? fs_sizes_begin(sizes, image->width, image->height, err) : fs_error_memory(err);
    for (size_t y = 0; rc == 0 && y < (size_t)image->height; y++) {
        const float *in = image->px + y * width * channels;
        memset(clipped, 0, width * sizeof *clipped);
        for (size_t i = 0; i < 3 * width; i++) {
            float v = channels == 3 ? in[i] : in[i / 3];
            if (!(v < limit) || !isfinite(v)) clipped[i / 3] = 1;
            if (!isfinite(v)) v = 1;
            rgb[i] = encoded ? fs_tone_srgb_decode(v) : v;
        }
        fs_sizes_row(sizes, rgb, clipped);
    }
    free(clipped);
    fs_sizes_end(sizes);
    return rc;
}

int fs_photo_read(const char *path, const double white_balance[3], PhotoSizes *sizes, bool *encoded, FsError *err)
{
    *encoded = false;
    fs_sizes_clear(sizes);
    if (fs_photo_kind_inside(path) == PHOTO_RAW) return fs_raw_read(path, white_balance, false, sizes, err);
    Image image = {0};
    int rc = read_display(path, &image, encoded, err);
    if (rc == 0) rc = linearise(&image, *encoded, sizes, err);
    fs_image_free(&image);
    if (rc < 0) fs_sizes_free(sizes);
    return rc;
}

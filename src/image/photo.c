// Photos: RAW as LibRaw and the demosaic give them, .npy by their levels, the others linearised where they hold display
// values.
#include "image/photo.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"
#include "image/heif.h"
#include "image/profile.h"
#include "image/raw.h"

#define CLIP_LINEAR 0.98f  // of white
#define CLIP_ENCODED 0.99f // of 255: a camera's curve is flat long before
#define LARGEST 100        // light of a photo whose white is 1, were most of it above that
#define FLOATS_BYTES 14    // a pixel, of what is not RAW, as it is read
#define HEIF_BYTES 12      // and these of HEIF
#define UNKNOWN_PIXELS 24e6

int fs_photo_kind(const char *path)
{
    static const struct {
        PhotoKind kind;
        const char *extensions;
    } known[] = {{PHOTO_RAW, "dng cr2 cr3 crw nef nrw arw sr2 srf raf orf rw2 pef srw x3f 3fr fff iiq erf mrw kdc dcr "
                             "mef mos rwl gpr"},
                 {PHOTO_NPY, "npy"},
                 {PHOTO_HEIF, "heic heif hif avif heics avifs"},
                 {PHOTO_JPEG, "jpg jpeg jpe jfif"},
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
    FILE *f;
    fs_file_open(path, &f, NULL);
    size_t n = f ? fread(head, 1, sizeof head, f) : 0;
    if (f) fclose(f);
    if (n < sizeof head) return kind < 0 ? PHOTO_RAW : (PhotoKind)kind;
    if (memcmp(head, "\xff\xd8\xff", 3) == 0) return PHOTO_JPEG;
    if (memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) return PHOTO_PNG;
    if (fs_heif_is(head)) return PHOTO_HEIF;
    if (memcmp(head, "\x93NUMPY", 6) == 0) return PHOTO_NPY;
    bool tiff = memcmp(head, "II*\0", 4) == 0 || memcmp(head, "MM\0*", 4) == 0; // or RAW
    if (tiff && kind > PHOTO_RAW) return PHOTO_TIFF;
    return kind < 0 ? PHOTO_RAW : (PhotoKind)kind;
}

// Of a copy that was broken off, say.
static int check_empty(const char *path, FsError *err)
{
    struct stat st;
    if (stat(path, &st) != 0 || st.st_size > 0 || !S_ISREG(st.st_mode)) return 0;
    return fs_error_input(err, "%s: is empty (0 bytes), expected a photo: copy it again", path);
}

// A header that was damaged would have all photos wait for memory that none needs.
static int check_size(const char *path, const ExifInfo *exif, FsError *err)
{
    if (exif->width <= FS_IMAGE_MAX_SIDE && exif->height <= FS_IMAGE_MAX_SIDE &&
        (double)exif->width * exif->height <= FS_IMAGE_MAX_PIXELS)
        return 0;
    return fs_error_input(err,
                          "%s: its header says %d x %d pixels, expected at most %d a side and %d in all: copy it again",
                          path, exif->width, exif->height, FS_IMAGE_MAX_SIDE, FS_IMAGE_MAX_PIXELS);
}

int fs_photo_read_info(const char *path, ExifInfo *exif, double white_balance[3], double *memory, FsError *err)
{
    RawInfo raw;
    for (int c = 0; c < 3; c++) white_balance[c] = 0;
    MUST(check_empty(path, err));
    MUST(fs_exif_read(path, exif, err));
    PhotoKind kind = fs_photo_kind_inside(path);
    if (kind == PHOTO_NPY) return fs_npy_photo_size(path, &exif->width, &exif->height, memory, err);
    double stored = (double)exif->width * exif->height;
    double bytes = FLOATS_BYTES + (kind == PHOTO_HEIF ? HEIF_BYTES : 0);
    if (memory) *memory = bytes * (stored > 0 ? stored : UNKNOWN_PIXELS);
    if (kind != PHOTO_RAW) return check_size(path, exif, err);
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
    switch (fs_photo_kind_inside(path)) {
    case PHOTO_HEIF: return fs_heif_read(path, image, err);
    case PHOTO_PNG: return fs_png_read(path, image, err);
    case PHOTO_TIFF: return fs_tiff_read(path, image, err);
    default: return fs_jpeg_read(path, image, err);
    }
}

static int read_tag(const char *path, LightTag *tag, FsError *err)
{
    switch (fs_photo_kind_inside(path)) {
    case PHOTO_HEIF: return fs_heif_read_tag(path, tag, err);
    case PHOTO_PNG: return fs_png_read_tag(path, tag, err);
    case PHOTO_TIFF: return fs_tiff_read_tag(path, tag, err);
    default: return fs_jpeg_read_tag(path, tag, err);
    }
}

static int read_profile(const char *path, Profile *profile, PhotoLight *light, FsError *err)
{
    LightTag tag;
    ExifInfo exif;
    MUST(fs_exif_read(path, &exif, err));
    MUST(read_tag(path, &tag, err));
    if (exif.adobe_rgb) tag.colors = COLORS_ADOBE;
    if (exif.srgb && !tag.icc && !tag.linear && tag.gamma <= 0) tag.srgb = true; // deep values, too
    ProfileSource source = fs_profile_of_tag(profile, &tag);
    fs_profile_tag_free(&tag);
    *light = source == PROFILE_UNTOLD                      ? PHOTO_UNTOLD
             : profile->linear                             ? PHOTO_LIGHT
             : source == PROFILE_UNREAD && !exif.adobe_rgb ? PHOTO_UNREAD
                                                           : PHOTO_ENCODED;
    return 0;
}

int fs_photo_space(const char *path, ProfileSpace *space, FsError *err)
{
    Profile profile;
    PhotoLight light;
    *space = PROFILE_SRGB;
    if (fs_photo_kind_inside(path) <= PHOTO_NPY) return 0;
    MUST(read_profile(path, &profile, &light, err));
    if (!profile.srgb_colors) *space = PROFILE_P3;
    return 0;
}

// In linear light, and where a channel was clipped. NaN and infinity count as clipped.
static int linearise(const Image *image, const Profile *profile, PhotoSizes *sizes, FsError *err)
{
    size_t width = (size_t)image->width, channels = (size_t)image->channels;
    float limit = profile->linear ? CLIP_LINEAR : CLIP_ENCODED, *clipped = malloc(width * 4 * sizeof *clipped);
    int rc = clipped ? fs_sizes_begin(sizes, image->width, image->height, err) : fs_error_memory(err);
    float *rgb = clipped ? clipped + width : NULL;
    for (size_t y = 0; rc == 0 && y < (size_t)image->height; y++) {
        const float *in = image->px + y * width * channels;
        memset(clipped, 0, width * sizeof *clipped);
        for (size_t i = 0; i < 3 * width; i++) {
            float v = channels == 3 ? in[i] : in[i / 3];
            if (!(v < limit) || !isfinite(v)) clipped[i / 3] = 1;
            rgb[i] = isfinite(v) ? v : 1;
        }
        fs_profile_linearise(profile, rgb, width);
        fs_sizes_row(sizes, rgb, clipped);
    }
    free(clipped);
    fs_sizes_end(sizes);
    return rc;
}

// Numbers of 8 or 16 bits in a file of floating point would all be clipped.
static int check_range(const char *path, const Image *image, FsError *err)
{
    size_t n = fs_image_values(image), above = 0;
    float most = 0;
    for (size_t i = 0; i < n; i++) {
        above += image->px[i] > 1 && isfinite(image->px[i]);
        if (image->px[i] > most && isfinite(image->px[i])) most = image->px[i];
    }
    if (above < n / 2 || most < LARGEST) return 0;
    return fs_error_input(err, "%s: its values reach %g, expected light from 0 (black) to 1 (white): save it so", path,
                          (double)most);
}

int fs_photo_read(const char *path, const SensorLevels *levels, PhotoSizes *sizes, PhotoLight *light, FsError *err)
{
    *light = PHOTO_LIGHT;
    fs_sizes_clear(sizes);
    PhotoKind kind = fs_photo_kind_inside(path);
    if (kind == PHOTO_RAW) return fs_raw_read(path, levels->gain, false, sizes, err);
    if (kind == PHOTO_NPY) return fs_npy_read_photo(path, levels, sizes, err);
    Image image = {0};
    Profile profile;
    int rc = read_profile(path, &profile, light, err);
    bool small = sizes->enough > 0 && kind == PHOTO_JPEG;
    if (rc == 0 && small) rc = fs_jpeg_read_small(path, sizes->enough, &image, err);
    if (rc == 0 && !small) rc = fs_photo_read_stored(path, &image, err);
    if (rc == 0) rc = check_range(path, &image, err);
    if (rc == 0) rc = linearise(&image, &profile, sizes, err);
    fs_image_free(&image);
    if (rc < 0) fs_sizes_free(sizes);
    return rc;
}

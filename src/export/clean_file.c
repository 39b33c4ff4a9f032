#include "export/clean_file.h"

#include <stdlib.h>
#include <string.h>

#include "image/raw.h"
#include "image/tiff_deep.h"
#include "image/tone.h"

#define JPEG_QUALITY 95
#define STRIP 64 // rows of a job

// ---- EXIF ----

static int put_bytes(Tags *tags, uint16_t id, const char *four, FsError *err)
{
    return fs_tags_put(tags, &(Tag){.folder = TAGS_EXIF, .id = id, .type = TAG_UNDEFINED, .count = 4}, four, err);
}

// What the photo says of itself, true of the new file too: upright, of its size, in its colours.
static int make_tags(const CleanPicture *p, ProfileSpace space, Tags *tags, FsError *err)
{
    enum { ORIENTATION = 0x0112, X_RESOLUTION = 0x011a, Y_RESOLUTION, RESOLUTION_UNIT = 0x0128, SOFTWARE = 0x0131 };
    enum { VERSION = 0x9000, FLASHPIX = 0xa000, COLORS, WIDTH, HEIGHT };
    char software[64];
    const double per_inch = 72;
    int rc;
    snprintf(software, sizeof software, "flashsplat %s", fs_version());
    MUST(fs_exif_read_tags(p->path.text, tags, err));
    TRY(fs_tags_put_number(tags, TAGS_MAIN, ORIENTATION, TAG_SHORT, 1, err));
    TRY(fs_tags_put_fractions(tags, X_RESOLUTION, TAG_RATIONAL, &per_inch, 1, err));
    TRY(fs_tags_put_fractions(tags, Y_RESOLUTION, TAG_RATIONAL, &per_inch, 1, err));
    TRY(fs_tags_put_number(tags, TAGS_MAIN, RESOLUTION_UNIT, TAG_SHORT, 2, err));
    TRY(fs_tags_put_text(tags, TAGS_MAIN, SOFTWARE, software, err));
    TRY(put_bytes(tags, VERSION, "0232", err));
    TRY(put_bytes(tags, FLASHPIX, "0100", err));
    TRY(fs_tags_put_number(tags, TAGS_EXIF, COLORS, TAG_SHORT, space == PROFILE_SRGB ? 1 : 65535, err));
    TRY(fs_tags_put_number(tags, TAGS_EXIF, WIDTH, TAG_LONG, (uint32_t)p->rgb.width, err));
    TRY(fs_tags_put_number(tags, TAGS_EXIF, HEIGHT, TAG_LONG, (uint32_t)p->rgb.height, err));
fail:
    if (rc < 0) fs_tags_free(tags);
    return rc;
}

// ---- linear ----

// Of a photo that is no RAW: a camera that sees in sRGB's primaries.
static int describe_camera(const CleanPicture *p, char name[140], DngCamera *camera, FsError *err)
{
    RawInfo raw = {0};
    const ExifInfo *exif = &p->photo.exif;
    if (p->photo.kind == PHOTO_RAW) MUST(fs_raw_read_info(p->path.text, &raw, err));
    snprintf(name, 140, "%s%s%s", exif->make, *exif->make && *exif->model ? " " : "", exif->model);
    *camera = (DngCamera){.name = *name ? name : "unknown", .baseline_exposure = raw.baseline_exposure};
    bool known = raw.camera_from_xyz[0] != 0 || raw.camera_from_xyz[1] != 0;
    for (int c = 0; c < 3; c++) {
        double wb = p->photo.kind <= PHOTO_NPY ? p->photo.white_balance[c] : 1;
        camera->neutral[c] = wb > 1e-3 ? 1 / wb : 1 / p->white_balance[c];
        for (int k = 0; k < 3; k++)
            camera->camera_from_xyz[3 * c + k] =
                known ? raw.camera_from_xyz[3 * c + k] : camera->neutral[c] * fs_profile_srgb_from_xyz[3 * c + k];
    }
    return 0;
}

static int write_dng(const CleanPicture *p, const char *path, FsError *err)
{
    char name[140];
    DngCamera camera;
    Tags tags;
    MUST(describe_camera(p, name, &camera, err));
    MUST(make_tags(p, PROFILE_SRGB, &tags, err));
    fs_tags_drop(&tags, TAGS_EXIF, 0xa001); // colour space: the matrix says more
    int rc = fs_tiff_deep_write_dng(path, &p->rgb, &tags, &camera, err);
    fs_tags_free(&tags);
    return rc;
}

// ---- for eyes ----

typedef struct Encode {
    Image *rgb;
    const Development *development; // NULL: values as the photo had them
    float factor[3];
    ProfileSpace space;
    bool linear; // factor alone
} Encode;

static void encode_strip(void *context, int strip, int worker)
{
    (void)worker;
    const Encode *e = context;
    int end = (strip + 1) * STRIP < e->rgb->height ? (strip + 1) * STRIP : e->rgb->height;
    for (int y = strip * STRIP; y < end; y++) {
        float *row = fs_image_at(e->rgb, 0, y);
        size_t n = (size_t)e->rgb->width;
        for (size_t i = 0; i < 3 * n; i++) row[i] *= e->factor[i % 3];
        if (e->linear) continue;
        if (e->development) {
            for (size_t i = 0; i < n; i++) fs_preview_develop(&e->development->light, row + 3 * i);
            continue;
        }
        fs_profile_to_space(e->space, row, n);
        for (size_t i = 0; i < 3 * n; i++) row[i] = fs_tone_srgb_encode(row[i]);
    }
}

static void encode_all(Encode *e, Threads *threads)
{
    fs_threads_for(threads, (e->rgb->height + STRIP - 1) / STRIP, encode_strip, e);
}

static int write_display(const CleanPicture *p, const bool *wanted, const char *stem, ProfileSpace space, FsError *err)
{
    Tags tags = {0};
    void *icc = NULL;
    unsigned char *exif = NULL;
    size_t icc_size, exif_size;
    int rc;
    TRY(make_tags(p, space, &tags, err));
    TRY(fs_profile_make(space, &icc, &icc_size, err));
    if (wanted[CLEAN_TIFF])
        TRY(fs_tiff_deep_write(fs_file_at("%s.tif", stem).text, &p->rgb, &tags, icc, icc_size, err));
    if (!wanted[CLEAN_JPEG]) goto fail;
    TRY(put_bytes(&tags, 0x9101, "\1\2\3\0", err));                       // Y, Cb, Cr
    TRY(fs_tags_put_number(&tags, TAGS_MAIN, 0x0213, TAG_SHORT, 1, err)); // in one place
    TRY(fs_tags_build(&tags, 8, &exif, &exif_size, err));
    const JpegExtras extras = {exif, exif_size, icc, icc_size};
    TRY(fs_jpeg_write(fs_file_at("%s.jpg", stem).text, &p->rgb, JPEG_QUALITY, &extras, err));
fail:
    fs_tags_free(&tags);
    free(icc);
    free(exif);
    return rc;
}

int fs_clean_file_write(const CleanArgs *args, CleanPicture *p, Threads *threads, FsError *err)
{
    FilePath stem = fs_file_at("%s/export/photos/%s", args->project->out, p->name);
    bool raw = p->photo.kind <= PHOTO_NPY; // a sensor's values
    Encode e = {.rgb = &p->rgb, .factor = {1, 1, 1}, .linear = true};
    if (args->wanted[CLEAN_DNG]) {
        for (int c = 0; c < 3; c++) e.factor[c] = raw ? (float)(1 / p->white_balance[c]) : 1;
        if (raw) encode_all(&e, threads);
        MUST(write_dng(p, fs_file_at("%s.dng", stem.text).text, err));
        for (int c = 0; c < 3; c++) e.factor[c] = 1 / e.factor[c];
    }
    if (!args->wanted[CLEAN_JPEG] && !args->wanted[CLEAN_TIFF]) return 0;
    e.linear = false;
    e.development = p->encoded ? NULL : args->development;
    for (int c = 0; c < 3 && !p->encoded; c++) e.factor[c] *= (float)p->photo.gain; // all photos as bright
    MUST(fs_photo_space(p->path.text, &e.space, err));
    if (e.development) e.space = PROFILE_SRGB;
    encode_all(&e, threads);
    return write_display(p, args->wanted, stem.text, e.space, err);
}

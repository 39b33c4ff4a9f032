// JPEG with EXIF, which is made from a table.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "image/tags.h"
#include "synth/photo_file.h"

typedef struct Entry {
    TagFolder folder;
    uint16_t id, type;
    const char *text;      // TAG_ASCII, TAG_UNDEFINED (4 bytes)
    uint32_t value, below; // numbers; below: denominator
} Entry;

static int put(Tags *tags, const Entry *e, FsError *err)
{
    const Tag four = {.folder = e->folder, .id = e->id, .type = e->type, .count = 4};
    switch (e->type) {
    case TAG_ASCII: return fs_tags_put_text(tags, e->folder, e->id, e->text, err);
    case TAG_UNDEFINED: return fs_tags_put(tags, &four, e->text, err);
    case TAG_RATIONAL: return fs_tags_put_ratio(tags, e->folder, e->id, e->value, e->below, err);
    default: return fs_tags_put_number(tags, e->folder, e->id, e->type, e->value, err);
    }
}

void fs_photo_file_time(const ShotInfo *info, char text[20])
{
    unsigned s = 6u * (unsigned)info->number;
    snprintf(text, 20, "2024:03:16 %02u:%02u:%02u", 10 + s / 3600 % 12, s / 60 % 60, s % 60);
}

static int make_tags(const ShotInfo *info, Tags *tags, FsError *err)
{
    char time[20];
    fs_photo_file_time(info, time);
    const Entry entry[] = {
        {TAGS_MAIN, 0x010f, TAG_ASCII, SHOT_MAKE},
        {TAGS_MAIN, 0x0110, TAG_ASCII, SHOT_MODEL},
        {TAGS_MAIN, 0x0112, TAG_SHORT, NULL, 1},
        {TAGS_MAIN, 0x011a, TAG_RATIONAL, NULL, 72, 1},
        {TAGS_MAIN, 0x011b, TAG_RATIONAL, NULL, 72, 1},
        {TAGS_MAIN, 0x0128, TAG_SHORT, NULL, 2},
        {TAGS_MAIN, 0x0131, TAG_ASCII, SHOT_SOFTWARE},
        {TAGS_MAIN, 0x0132, TAG_ASCII, time},
        {TAGS_EXIF, 0x829a, TAG_RATIONAL, NULL, 1, (unsigned)info->exposure.shutter},
        {TAGS_EXIF, 0x829d, TAG_RATIONAL, NULL, (unsigned)lround(10 * info->exposure.f_number), 10},
        {TAGS_EXIF, 0x8822, TAG_SHORT, NULL, 1}, // exposure set by hand
        {TAGS_EXIF, 0x8827, TAG_SHORT, NULL, (unsigned)info->exposure.iso},
        {TAGS_EXIF, 0x9000, TAG_UNDEFINED, "0230"},
        {TAGS_EXIF, 0x9003, TAG_ASCII, time},
        {TAGS_EXIF, 0x9004, TAG_ASCII, time},
        {TAGS_EXIF, 0x9101, TAG_UNDEFINED, "\1\2\3\0"},
        {TAGS_EXIF, 0x9209, TAG_SHORT, NULL, info->flash ? 9 : 16}, // fired, compulsory; or suppressed
        {TAGS_EXIF, 0x920a, TAG_RATIONAL, NULL, (unsigned)lround(100 * info->focal_mm), 100},
        {TAGS_EXIF, 0xa000, TAG_UNDEFINED, "0100"},
        {TAGS_EXIF, 0xa001, TAG_SHORT, NULL, 1},
        {TAGS_EXIF, 0xa002, TAG_LONG, NULL, (unsigned)info->width},
        {TAGS_EXIF, 0xa003, TAG_LONG, NULL, (unsigned)info->height},
        {TAGS_EXIF, 0xa402, TAG_SHORT, NULL, 1},
        {TAGS_EXIF, 0xa403, TAG_SHORT, NULL, !info->exposure.automatic},
        {TAGS_EXIF, 0xa405, TAG_SHORT, NULL, (unsigned)info->focal_35mm},
    };
    for (size_t i = 0; i < sizeof entry / sizeof *entry; i++) MUST(put(tags, &entry[i], err));
    return 0;
}

int fs_photo_file_write_jpeg(const char *path, const Image *picture, const ShotInfo *info, FsError *err)
{
    Tags tags = {0};
    unsigned char *exif = NULL;
    size_t size;
    int rc;
    TRY(make_tags(info, &tags, err));
    TRY(fs_tags_build(&tags, 8, &exif, &size, err));
    TRY(fs_jpeg_write(path, picture, 95, &(JpegExtras){.exif = exif, .exif_size = size}, err));
fail:
    fs_tags_free(&tags);
    free(exif);
    return rc;
}

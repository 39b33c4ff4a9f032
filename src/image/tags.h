// Tags of TIFF directories: what a photo's EXIF says, taken out of any kind of photo file and put into a new one.
#pragma once

#include "base/error.h"

typedef enum TagFolder { TAGS_MAIN, TAGS_EXIF, TAGS_GPS, TAG_FOLDERS } TagFolder;
enum {
    TAG_BYTE = 1,
    TAG_ASCII = 2,
    TAG_SHORT = 3,
    TAG_LONG = 4,
    TAG_RATIONAL = 5,
    TAG_UNDEFINED = 7,
    TAG_SRATIONAL = 10
};

typedef struct Tag {
    TagFolder folder;
    uint16_t id, type;
    uint32_t count;
    size_t at, size; // of its value in Tags.bytes
} Tag;

typedef struct Tags {
    Tag *tag; // by folder and number
    int n;
    unsigned char *bytes; // values, little-endian
    size_t used;
} Tags;

void fs_tags_free(Tags *tags);
size_t fs_tags_value_size(uint16_t type); // bytes; 0: no type of TIFF 6
// value: count values, little-endian; replaces one that is there. FS_ERR_USAGE where it is larger than all EXIF may be.
int fs_tags_put(Tags *tags, const Tag *tag, const void *value, FsError *err);
// One value: SHORT or LONG; a text with its 0; a RATIONAL.
int fs_tags_put_number(Tags *tags, TagFolder folder, uint16_t id, uint16_t type, uint32_t value, FsError *err);
int fs_tags_put_text(Tags *tags, TagFolder folder, uint16_t id, const char *text, FsError *err);
int fs_tags_put_ratio(Tags *tags, TagFolder folder, uint16_t id, uint32_t above, uint32_t below, FsError *err);
// (n) as fractions; type: TAG_RATIONAL (of what is at least 0) or TAG_SRATIONAL.
int fs_tags_put_fractions(Tags *tags, uint16_t id, uint16_t type, const double *value, int n, FsError *err);
int fs_tags_copy(Tags *to, const Tags *from, FsError *err);   // `to` is made anew; {0} after a failure
void fs_tags_drop(Tags *tags, TagFolder folder, uint16_t id); // where it is there
// The directories one after the other, as they lie at `start` of a TIFF file; for start 8 the file's head is before
// them. Free the block.
int fs_tags_build(const Tags *tags, uint32_t start, unsigned char **block, size_t *size, FsError *err);

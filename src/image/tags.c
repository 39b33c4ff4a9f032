#include "image/tags.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

#define MOST_BYTES 60000 // of all values: what a JPEG's segment holds, with the directories
#define HEAD 8

void fs_tags_free(Tags *tags)
{
    free(tags->tag);
    free(tags->bytes);
    *tags = (Tags){0};
}

size_t fs_tags_value_size(uint16_t type)
{
    static const unsigned char size[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    return type < sizeof size ? size[type] : 0;
}

void fs_tags_drop(Tags *tags, TagFolder folder, uint16_t id)
{
    int kept = 0;
    for (int i = 0; i < tags->n; i++)
        if (tags->tag[i].folder != folder || tags->tag[i].id != id) tags->tag[kept++] = tags->tag[i];
    tags->n = kept;
}

int fs_tags_put(Tags *tags, const Tag *tag, const void *value, FsError *err)
{
    size_t each = fs_tags_value_size(tag->type), size = each * tag->count;
    if (!each || !tag->count || tag->count > MOST_BYTES || size > MOST_BYTES - tags->used)
        return fs_error_set(err, FS_ERR_USAGE, "a tag %#x of %u values of type %u", tag->id, tag->count, tag->type);
    fs_tags_drop(tags, tag->folder, tag->id);
    MUST(fs_memory_grow(&tags->tag, tags->n, sizeof *tags->tag, err));
    unsigned char *bytes = realloc(tags->bytes, tags->used + size);
    if (!bytes) return fs_error_memory(err);
    tags->bytes = bytes;
    memcpy(bytes + tags->used, value, size);
    int at = tags->n++;
    for (; at > 0; at--) { // directories are sorted
        const Tag *before = &tags->tag[at - 1];
        if (before->folder < tag->folder || (before->folder == tag->folder && before->id < tag->id)) break;
        tags->tag[at] = *before;
    }
    tags->tag[at] = *tag;
    tags->tag[at].at = tags->used;
    tags->tag[at].size = size;
    tags->used += size;
    return 0;
}

static void put(unsigned char *at, uint32_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) at[i] = (unsigned char)(value >> (8 * i));
}

int fs_tags_put_number(Tags *tags, TagFolder folder, uint16_t id, uint16_t type, uint32_t value, FsError *err)
{
    unsigned char bytes[4];
    put(bytes, value, 4);
    return fs_tags_put(tags, &(Tag){.folder = folder, .id = id, .type = type, .count = 1}, bytes, err);
}

int fs_tags_put_text(Tags *tags, TagFolder folder, uint16_t id, const char *text, FsError *err)
{
    const Tag tag = {.folder = folder, .id = id, .type = TAG_ASCII, .count = (uint32_t)strlen(text) + 1};
    return fs_tags_put(tags, &tag, text, err);
}

int fs_tags_put_ratio(Tags *tags, TagFolder folder, uint16_t id, uint32_t above, uint32_t below, FsError *err)
{
    unsigned char bytes[8];
    put(bytes, above, 4);
    put(bytes + 4, below, 4);
    return fs_tags_put(tags, &(Tag){.folder = folder, .id = id, .type = TAG_RATIONAL, .count = 1}, bytes, err);
}

int fs_tags_put_fractions(Tags *tags, uint16_t id, uint16_t type, const double *value, int n, FsError *err)
{
    unsigned char bytes[8 * 16];
    const uint32_t below = 1000000;
    for (int i = 0; i < n && i < 16; i++) {
        double v = fmax(-2000, fmin(2000, value[i])) * below; // what 32 bits hold
        put(bytes + 8 * i, (uint32_t)(int32_t)lround(v), 4);
        put(bytes + 8 * i + 4, below, 4);
    }
    return fs_tags_put(tags, &(Tag){.id = id, .type = type, .count = (uint32_t)n}, bytes, err);
}

int fs_tags_copy(Tags *to, const Tags *from, FsError *err)
{
    *to = (Tags){0};
    for (int i = 0; i < from->n; i++) {
        int rc = fs_tags_put(to, &from->tag[i], from->bytes + from->tag[i].at, err);
        if (rc < 0) {
            fs_tags_free(to);
            return rc;
        }
    }
    return 0;
}

// ---- directories ----

static size_t even(size_t n)
{
    return n + (n & 1);
}

// A directory and its long values.
static size_t folder_size(const Tags *tags, TagFolder folder)
{
    size_t size = 0;
    for (int i = 0; i < tags->n; i++)
        if (tags->tag[i].folder == folder) size += 12 + (tags->tag[i].size > 4 ? even(tags->tag[i].size) : 0);
    return size ? size + 6 : 0;
}

// The directory at `at` of the block, which lies at `start` of the file.
static void build_folder(const Tags *tags, TagFolder folder, unsigned char *block, size_t at, uint32_t start)
{
    int n = 0, k = 0;
    for (int i = 0; i < tags->n; i++) n += tags->tag[i].folder == folder;
    size_t longer = at + 6 + 12 * (size_t)n;
    put(block + at, (uint32_t)n, 2);
    for (int i = 0; i < tags->n; i++) {
        const Tag *tag = &tags->tag[i];
        if (tag->folder != folder) continue;
        unsigned char *entry = block + at + 2 + 12 * (size_t)k++;
        put(entry, tag->id, 2);
        put(entry + 2, tag->type, 2);
        put(entry + 4, tag->count, 4);
        if (tag->size <= 4) {
            memcpy(entry + 8, tags->bytes + tag->at, tag->size);
        } else {
            put(entry + 8, start + (uint32_t)longer, 4);
            memcpy(block + longer, tags->bytes + tag->at, tag->size);
            longer += even(tag->size);
        }
    }
}

int fs_tags_build(const Tags *tags, uint32_t start, unsigned char **block, size_t *size, FsError *err)
{
    static const uint16_t link[TAG_FOLDERS] = {0, 0x8769, 0x8825};
    Tags all;
    size_t place[TAG_FOLDERS], head = start == HEAD ? HEAD : 0;
    MUST(fs_tags_copy(&all, tags, err));
    int rc = 0;
    for (int f = 1; f < TAG_FOLDERS; f++) // their size is known before what they hold
        if (folder_size(tags, (TagFolder)f)) TRY(fs_tags_put_number(&all, TAGS_MAIN, link[f], TAG_LONG, 0, err));
    *size = head;
    for (int f = 0; f < TAG_FOLDERS; f++) {
        place[f] = *size;
        *size += folder_size(&all, (TagFolder)f);
    }
    for (int f = 1; f < TAG_FOLDERS; f++)
        if (folder_size(tags, (TagFolder)f))
            TRY(fs_tags_put_number(&all, TAGS_MAIN, link[f], TAG_LONG, start + (uint32_t)(place[f] - head), err));
    *block = calloc(1, *size + 1);
    if (!*block) TRY(fs_error_memory(err));
    if (head) memcpy(*block, "II*\0\10\0\0\0", HEAD);
    for (int f = 0; f < TAG_FOLDERS; f++)
        if (folder_size(&all, (TagFolder)f)) build_folder(&all, (TagFolder)f, *block, place[f], start - (uint32_t)head);
fail:
    fs_tags_free(&all);
    return rc;
}

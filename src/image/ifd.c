#include "image/ifd.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MAX_ENTRIES 4096 // of one directory
#define MOST_VALUES 65536
#define MAX_LOOKS 100000 // at directories, entries and values in search of picture data: links may lead in circles

typedef struct Ifd {
    const Block *block;
    bool big; // byte order: Motorola
} Ifd;

typedef struct Entry {
    uint16_t tag, type;
    uint32_t count;
    unsigned char value[4]; // or where it is
} Entry;

bool fs_ifd_read_at(const Block *block, uint64_t offset, void *to, size_t n)
{
    if (offset > block->size || n > block->size - offset) return false;
    char *out = to;
    if (block->memory) memcpy(to, block->memory + block->start + offset, n);
    while (n > 0 && !block->memory) {
        ssize_t got = pread(block->fd, out, n, (off_t)(block->start + offset));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        out += got, offset += (uint64_t)got, n -= (size_t)got;
    }
    return true;
}

static uint16_t get16(const Ifd *ifd, const unsigned char *p)
{
    return (uint16_t)(ifd->big ? p[0] << 8 | p[1] : p[1] << 8 | p[0]);
}

static uint32_t get32(const Ifd *ifd, const unsigned char *p)
{
    return ifd->big ? (uint32_t)get16(ifd, p) << 16 | get16(ifd, p + 2)
                    : (uint32_t)get16(ifd, p + 2) << 16 | get16(ifd, p);
}

static size_t type_size(uint16_t type)
{
    static const unsigned char size[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4}; // 13: IFD, a LONG
    return type < sizeof size ? size[type] : 0;
}

// The i-th value of an entry as a number; false when there is none.
static bool number(const Ifd *ifd, const Entry *e, uint32_t i, double *to)
{
    unsigned char p[8];
    size_t size = type_size(e->type);
    if (size == 0 || i >= e->count) return false;
    if (size * e->count <= 4)
        memcpy(p, e->value + size * i, size);
    else if (!fs_ifd_read_at(ifd->block, get32(ifd, e->value) + (uint64_t)size * i, p, size))
        return false;
    float f;
    uint32_t a = size >= 4 ? get32(ifd, p) : 0, b = size == 8 ? get32(ifd, p + 4) : 0;
    switch (e->type) {
    case 1:
    case 7: *to = p[0]; break;
    case 3: *to = get16(ifd, p); break;
    case 4:
    case 13: *to = a; break;
    case 5: *to = b ? (double)a / b : 0.0; break;
    case 6: *to = (int8_t)p[0]; break;
    case 8: *to = (int16_t)get16(ifd, p); break;
    case 9: *to = (int32_t)a; break;
    case 10: *to = b ? (double)(int32_t)a / (int32_t)b : 0.0; break;
    case 11: memcpy(&f, &a, sizeof f), *to = f; break;
    default: return false;
    }
    return isfinite(*to);
}

static void set_number(const Ifd *ifd, const Entry *e, double max, double *to)
{
    double v;
    if (number(ifd, e, 0, &v) && v > 0 && v <= max) *to = v;
}

static void set_int(const Ifd *ifd, const Entry *e, int min, int max, int *to)
{
    double v;
    if (number(ifd, e, 0, &v) && v >= min && v <= max) *to = (int)v;
}

static void set_text(const Ifd *ifd, const Entry *e, char to[64])
{
    char text[64] = {0};
    if (e->type != 2 || e->count < 2) return;
    size_t n = e->count < sizeof text - 1 ? e->count : sizeof text - 1;
    if (e->count <= 4)
        memcpy(text, e->value, n);
    else if (!fs_ifd_read_at(ifd->block, get32(ifd, e->value), text, n))
        return;
    size_t length = strnlen(text, n);
    while (length > 0 && text[length - 1] == ' ') length--;
    for (size_t i = 0; i < length; i++)
        if (text[i] < ' ' || text[i] > '~') text[i] = '?';
    text[length] = 0;
    memcpy(to, text, sizeof text);
}

// ---- taking tags along ----

// What says something of the shot or of who took it; not what is about the file: sizes, places, thumbnails, previews,
// its unique number, where in the stored picture the subject is, the makers' own notes, whose insides point to places
// in the file.
static bool is_kept(uint16_t id, TagFolder *folder)
{
    static const uint16_t ranges[][2] = {
        {0x829a, 0x829d}, {0x8822, 0x8822}, {0x8824, 0x8824}, {0x8827, 0x8827}, {0x8830, 0x8835}, {0x9000, 0x9101},
        {0x9201, 0x920a}, {0x9286, 0x9292}, {0x9400, 0x9405}, {0xa000, 0xa000}, {0xa20e, 0xa213}, {0xa215, 0xa217},
        {0xa300, 0xa301}, {0xa401, 0xa40a}, {0xa40c, 0xa40c}, {0xa430, 0xa437}, {0xa460, 0xa462}};
    static const uint16_t main[] = {0x010e, 0x010f, 0x0110, 0x0132, 0x013b, 0x8298};
    for (size_t i = 0; i < sizeof main / sizeof *main; i++)
        if (id == main[i]) return true;
    *folder = TAGS_EXIF; // wherever it stands: CR3 keeps them in a first directory
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++)
        if (id >= ranges[i][0] && id <= ranges[i][1]) return true;
    return false;
}

// Big-endian values turned round.
static void to_little(unsigned char *value, uint16_t type, size_t size)
{
    size_t unit = type == 5 || type == 10 ? 4 : fs_tags_value_size(type);
    for (size_t at = 0; at + unit <= size; at += unit)
        for (size_t i = 0; i < unit / 2; i++) {
            unsigned char v = value[at + i];
            value[at + i] = value[at + unit - 1 - i];
            value[at + unit - 1 - i] = v;
        }
}

// What is taken along must leave room in 64 KB for what the new file says of itself (in a TIFF up to 32 KB of strips).
// What is longer than half of it is left out for the sake of all others.
enum { MOST_TAKEN = 20000 };

static void keep_entry(const Ifd *ifd, const Entry *e, TagFolder folder, Tags *tags)
{
    size_t each = fs_tags_value_size(e->type), size = each * e->count;
    if (!each || e->count > MOST_VALUES || size > MOST_TAKEN / 2 || size > MOST_TAKEN - tags->used ||
        (folder == TAGS_GPS ? e->tag > 31 : !is_kept(e->tag, &folder)))
        return;
    unsigned char *value = malloc(size + 1);
    bool there = value && (size > 4 ? fs_ifd_read_at(ifd->block, get32(ifd, e->value), value, size) : true);
    if (!value) fs_error_memory(NULL);
    if (there && size <= 4) memcpy(value, e->value, size);
    if (there && ifd->big) to_little(value, e->type, size);
    bool utf16 = there && e->tag == 0x9286 && size > 8 && memcmp(value, "UNICODE", 8) == 0; // UserComment
    if (utf16 && ifd->big) to_little(value + 8, TAG_SHORT, size - 8);
    const Tag tag = {.folder = folder, .id = e->tag, .type = e->type, .count = e->count};
    if (there) fs_tags_put(tags, &tag, value, NULL);
    free(value);
}

// Values that only some entries together make.
typedef struct Parts {
    double plane_x, plane_unit; // FocalPlaneXResolution and its unit
    double shutter_apex, aperture_apex;
    uint32_t exif_offset, interop_offset, gps_offset;
    int width, height;
} Parts;

static void read_entry(const Ifd *ifd, const Entry *e, ExifInfo *info, Parts *parts)
{
    double v;
    switch (e->tag) {
    case 0x0100: set_int(ifd, e, 1, 1000000, &parts->width); break;
    case 0x0101: set_int(ifd, e, 1, 1000000, &parts->height); break;
    case 0x010f: set_text(ifd, e, info->make); break;
    case 0x0110: set_text(ifd, e, info->model); break;
    case 0x0112: set_int(ifd, e, 1, 8, &info->orientation); break;
    case 0x829a: set_number(ifd, e, 1e6, &info->exposure_s); break;
    case 0x829d: set_number(ifd, e, 1e4, &info->f_number); break;
    case 0x8769:
        if (number(ifd, e, 0, &v) && v > 0 && v <= UINT32_MAX) parts->exif_offset = (uint32_t)v;
        break;
    case 0x8825:
        if (number(ifd, e, 0, &v) && v > 0 && v <= UINT32_MAX) parts->gps_offset = (uint32_t)v;
        break;
    case 0xa005:
        if (number(ifd, e, 0, &v) && v > 0 && v <= UINT32_MAX) parts->interop_offset = (uint32_t)v;
        break;
    case 0x8827: // 65535: too large for its field, see the next two
        if (number(ifd, e, 0, &v) && v > 0 && v < 65535) info->iso = v;
        break;
    case 0x8832:
    case 0x8833:
        if (info->iso == 0) set_number(ifd, e, 1e8, &info->iso);
        break;
    case 0x9003: set_text(ifd, e, info->taken); break;
    case 0x9201:
        if (number(ifd, e, 0, &v) && fabs(v) < 30) parts->shutter_apex = v;
        break;
    case 0x9202:
        if (number(ifd, e, 0, &v) && fabs(v) < 30) parts->aperture_apex = v;
        break;
    case 0x9206: set_number(ifd, e, 1e10, &info->focus_m); break;
    case 0x9209: set_int(ifd, e, 0, 65535, &info->flash); break;
    case 0x920a: set_number(ifd, e, 1e5, &info->focal_mm); break;
    case 0xa001: // ColorSpace
        if (number(ifd, e, 0, &v)) info->srgb = v == 1;
        break;
    case 0xa002: set_int(ifd, e, 1, 1000000, &info->exif_width); break;
    case 0xa003: set_int(ifd, e, 1, 1000000, &info->exif_height); break;
    case 0xa20e: set_number(ifd, e, 1e8, &parts->plane_x); break;
    case 0xa210: set_number(ifd, e, 5, &parts->plane_unit); break;
    case 0xa403:
        if (number(ifd, e, 0, &v) && (v == 0 || v == 1)) info->white = v == 0 ? WHITE_AUTO : WHITE_BY_HAND;
        break;
    case 0xa405: set_number(ifd, e, 1e5, &info->focal_35mm); break;
    case 0xa434: set_text(ifd, e, info->lens); break;
    case 0xc628: { // AsShotNeutral
        double n[3];
        if (e->count == 3 && number(ifd, e, 0, &n[0]) && number(ifd, e, 1, &n[1]) && number(ifd, e, 2, &n[2]) &&
            n[0] > 0 && n[1] > 0 && n[2] > 0)
            for (int c = 0; c < 3; c++) info->neutral[c] = n[c] / n[1];
        break;
    }
    default: break;
    }
}

// Number of entries of a directory; 0 where there is none.
static unsigned count_entries(const Ifd *ifd, uint64_t offset)
{
    unsigned char p[2];
    unsigned n = fs_ifd_read_at(ifd->block, offset, p, 2) ? get16(ifd, p) : 0;
    return n <= MAX_ENTRIES ? n : 0;
}

static bool get_entry(const Ifd *ifd, uint64_t directory, unsigned i, Entry *e)
{
    unsigned char p[12];
    if (!fs_ifd_read_at(ifd->block, directory + 2 + 12 * (uint64_t)i, p, 12)) return false;
    *e = (Entry){.tag = get16(ifd, p), .type = get16(ifd, p + 2), .count = get32(ifd, p + 4)};
    memcpy(e->value, p + 8, 4);
    return true;
}

static void read_directory(const Ifd *ifd, uint64_t offset, ExifInfo *info, Parts *parts)
{
    Entry e;
    unsigned n = count_entries(ifd, offset);
    for (unsigned i = 0; i < n && get_entry(ifd, offset, i, &e); i++) {
        read_entry(ifd, &e, info, parts);
        if (info->tags) keep_entry(ifd, &e, TAGS_MAIN, info->tags);
    }
}

// False when the block is not TIFF.
static bool read_head(const Block *block, Ifd *ifd, uint32_t *first)
{
    unsigned char head[8];
    if (!fs_ifd_read_at(block, 0, head, sizeof head)) return false;
    *ifd = (Ifd){.block = block, .big = head[0] == 'M'};
    uint16_t magic = get16(ifd, head + 2); // 42, or what Panasonic (0x55) and Olympus (the rest) have there
    *first = get32(ifd, head + 4);
    return head[0] == head[1] && (head[0] == 'I' || head[0] == 'M') &&
           (magic == 42 || magic == 0x55 || magic == 0x4f52 || magic == 0x5352);
}

bool fs_ifd_read(const Block *block, ExifInfo *info)
{
    Ifd ifd;
    uint32_t first;
    if (!read_head(block, &ifd, &first)) return false;
    Parts parts = {.plane_unit = 2};
    read_directory(&ifd, first, info, &parts);
    if (parts.exif_offset) read_directory(&ifd, parts.exif_offset, info, &parts);
    Entry e;
    unsigned n = parts.interop_offset ? count_entries(&ifd, parts.interop_offset) : 0;
    for (unsigned i = 0; i < n && get_entry(&ifd, parts.interop_offset, i, &e); i++)
        if (e.tag == 1 && e.type == 2 && memcmp(e.value, "R03", 3) == 0) info->adobe_rgb = true;
    n = parts.gps_offset && info->tags ? count_entries(&ifd, parts.gps_offset) : 0;
    for (unsigned i = 0; i < n && get_entry(&ifd, parts.gps_offset, i, &e); i++)
        keep_entry(&ifd, &e, TAGS_GPS, info->tags);
    if (info->exposure_s == 0 && parts.shutter_apex != 0) info->exposure_s = exp2(-parts.shutter_apex);
    if (info->f_number == 0 && parts.aperture_apex > 0) info->f_number = exp2(parts.aperture_apex / 2);
    if (info->width == 0 && parts.width > 0 && parts.height > 0) // of a TIFF; others have said theirs
        info->width = parts.width, info->height = parts.height;
    static const double mm[] = {0, 0, 25.4, 10, 1, 0.001}; // of FocalPlaneResolutionUnit
    double unit = mm[(int)parts.plane_unit];
    if (parts.plane_x > 0 && unit > 0) info->pixels_per_mm = parts.plane_x / unit;
    return true;
}

// ---- how far the picture data reach ----

// Strips or tiles: where they begin, and their sizes.
static void add_parts(const Ifd *ifd, const Entry *offsets, const Entry *sizes, IfdMissing *m)
{
    double at, size, held = (double)ifd->block->size;
    for (uint32_t i = 0; i < offsets->count && i < sizes->count && m->looks++ < MAX_LOOKS; i++) {
        if (!number(ifd, offsets, i, &at) || !number(ifd, sizes, i, &size) || at >= UINT32_MAX || size < 0) return;
        m->all += (uint64_t)size;
        m->missing += (uint64_t)fmin(size, fmax(0, at + size - held));
    }
}

static void add_directory(const Ifd *ifd, uint64_t offset, int depth, IfdMissing *m)
{
    for (int next = 0; next < 10 && offset > 0 && m->looks++ < MAX_LOOKS; next++) {
        Entry e, strips = {0}, strip_sizes = {0}, tiles = {0}, tile_sizes = {0}, inner = {0};
        unsigned char p[4];
        unsigned n = count_entries(ifd, offset);
        for (unsigned i = 0; i < n && m->looks++ < MAX_LOOKS && get_entry(ifd, offset, i, &e); i++) {
            if (e.tag == 0x0111 && strips.tag != 0x0118) strips = e;
            if (e.tag == 0x0118) strips = e; // Panasonic's
            if (e.tag == 0x0117) strip_sizes = e;
            if (e.tag == 0x0144) tiles = e;
            if (e.tag == 0x0145) tile_sizes = e;
            if (e.tag == 0x014a) inner = e;
            m->dng |= e.tag == 0xc612;
        }
        add_parts(ifd, &strips, &strip_sizes, m);
        add_parts(ifd, &tiles, &tile_sizes, m);
        for (uint32_t i = 0; i < inner.count && i < 10 && depth > 0; i++) {
            double at;
            if (number(ifd, &inner, i, &at) && at >= 0 && at <= UINT32_MAX)
                add_directory(ifd, (uint64_t)at, depth - 1, m);
        }
        if (n == 0 || !fs_ifd_read_at(ifd->block, offset + 2 + 12 * (uint64_t)n, p, 4)) return;
        offset = get32(ifd, p);
    }
}

IfdMissing fs_ifd_missing(const Block *block)
{
    Ifd ifd;
    uint32_t first;
    IfdMissing m = {0};
    if (read_head(block, &ifd, &first)) add_directory(&ifd, first, 2, &m);
    return m;
}

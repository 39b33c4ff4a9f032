// Finds the TIFF blocks that hold EXIF inside each kind of photo file; ifd.c reads them.
#include "image/exif.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "image/boxes.h"
#include "image/heif.h"

#define MAX_TEXT (1 << 20) // of a PNG
#define MAX_PARTS 10000    // segments, chunks or boxes looked at in one file

static uint32_t big16(const unsigned char *p)
{
    return (uint32_t)(p[0] << 8 | p[1]);
}

static uint32_t big32(const unsigned char *p)
{
    return big16(p) << 16 | big16(p + 2);
}

static Block part(const Block *block, uint64_t offset, uint64_t size)
{
    return (Block){.fd = block->fd, .start = block->start + offset, .size = size, .memory = block->memory};
}

// A TIFF block, with "Exif\0\0" before it or not. What it says of a size is of its thumbnail or not of the file.
static void read_block(const Block *block, ExifInfo *info)
{
    unsigned char head[6];
    int width = info->width, height = info->height;
    bool named = fs_ifd_read_at(block, 0, head, 6) && memcmp(head, "Exif\0\0", 6) == 0;
    Block inside = named ? part(block, 6, block->size - 6) : *block;
    fs_ifd_read(&inside, info);
    info->width = width, info->height = height;
}

// A frame's header; those of a JPEG's thumbnail lie inside another segment.
static bool is_frame(unsigned char marker)
{
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

static void read_jpeg(const Block *file, ExifInfo *info)
{
    unsigned char p[10];
    uint64_t at = 2;
    bool seen = false;
    for (int i = 0; i < MAX_PARTS && fs_ifd_read_at(file, at, p, 4); i++) {
        if (p[0] != 0xff) return;
        if (p[1] == 0xff) { // fill byte
            at++;
            continue;
        }
        if (p[1] == 0xda || p[1] == 0xd9) return; // the picture itself, or the end
        uint64_t size = big16(p + 2);
        if (size < 2) return;
        if (is_frame(p[1]) && fs_ifd_read_at(file, at + 4, p + 4, 5)) {
            info->height = (int)big16(p + 5);
            info->width = (int)big16(p + 7);
            return;
        }
        if (p[1] == 0xe1 && !seen && size > 8 && fs_ifd_read_at(file, at + 4, p, 6) && memcmp(p, "Exif\0\0", 6) == 0) {
            Block exif = part(file, at + 10, size - 8);
            if (exif.size <= file->size - (at + 10)) read_block(&exif, info);
            seen = true;
        }
        at += 2 + size;
    }
}

// ---- PNG: the chunk eXIf, or the text that ImageMagick and exiftool of old write ----

static unsigned char *get_chunk(const Block *file, uint64_t at, uint64_t size, size_t *n)
{
    unsigned char *data = size <= MAX_TEXT && size <= file->size - at ? malloc(size + 1) : NULL;
    if (!data && size <= MAX_TEXT && size <= file->size - at) fs_error_memory(NULL);
    if (data && !fs_ifd_read_at(file, at, data, size)) {
        free(data);
        data = NULL;
    }
    if (data) data[size] = 0;
    *n = (size_t)size;
    return data;
}

// Without the compression of zTXt; the caller frees.
static unsigned char *unpack_text(const unsigned char *data, size_t n, uLong *size)
{
    unsigned char *text = malloc(MAX_TEXT + 1);
    *size = MAX_TEXT;
    if (!text) fs_error_memory(NULL);
    if (!text || uncompress(text, size, data, n) != Z_OK) {
        free(text);
        return NULL;
    }
    text[*size] = 0;
    return text;
}

// "\nexif\n  1234\n" and the bytes in hexadecimal, in lines; in place. Gives how many bytes there are.
static size_t decode_hex(unsigned char *text, size_t n)
{
    size_t out = 0, digits = 0;
    int lines = 0;
    for (size_t i = 0; i < n; i++) {
        const char *hex = "0123456789abcdef", *digit = strchr(hex, tolower(text[i]));
        if (text[i] == '\n') lines++;
        if (lines < 3 || !text[i] || !digit) continue;
        unsigned char v = (unsigned char)(digit - hex);
        if (digits++ % 2)
            text[out++] |= v;
        else
            text[out] = (unsigned char)(v << 4);
    }
    return out;
}

// A chunk tEXt or zTXt: keyword, 0, the text (compressed: after another 0).
static void read_text(const Block *file, uint64_t at, uint64_t size, bool packed, ExifInfo *info)
{
    size_t n;
    unsigned char *data = get_chunk(file, at, size, &n), *text = NULL;
    size_t skip = data ? strlen((char *)data) + (packed ? 2 : 1) : 0;
    bool profile = data && (strcmp((char *)data, "Raw profile type exif") == 0 ||
                            strcmp((char *)data, "Raw profile type APP1") == 0);
    uLong length = profile && skip < n ? n - skip : 0;
    if (length && packed)
        text = unpack_text(data + skip, n - skip, &length);
    else if (length)
        text = data + skip;
    if (text) {
        Block exif = {.fd = -1, .memory = text, .size = decode_hex(text, length)};
        read_block(&exif, info);
    }
    if (packed) free(text);
    free(data);
}

static void read_png(const Block *file, ExifInfo *info)
{
    unsigned char p[8];
    uint64_t at = 8;
    if (fs_ifd_read_at(file, 16, p, 8) && big32(p) <= INT32_MAX && big32(p + 4) <= INT32_MAX)
        info->width = (int)big32(p), info->height = (int)big32(p + 4);
    for (int i = 0; i < MAX_PARTS && fs_ifd_read_at(file, at, p, 8); i++) {
        uint64_t size = big32(p);
        if (memcmp(p + 4, "eXIf", 4) == 0 && size <= file->size - at - 8) {
            Block exif = part(file, at + 8, size);
            read_block(&exif, info);
            return;
        }
        if (memcmp(p + 4, "tEXt", 4) == 0 || memcmp(p + 4, "zTXt", 4) == 0)
            read_text(file, at + 8, size, p[4] == 'z', info);
        at += size + 12;
    }
}

static void read_raf(const Block *file, ExifInfo *info) // Fujifilm: a JPEG inside has the EXIF
{
    unsigned char p[8];
    if (!fs_ifd_read_at(file, 84, p, 8)) return;
    uint64_t offset = big32(p), size = big32(p + 4);
    if (offset >= file->size || size > file->size - offset) return;
    Block jpeg = part(file, offset, size);
    read_jpeg(&jpeg, info);
}

static void read_mrw(const Block *file, ExifInfo *info) // Minolta: blocks, of which TTW is a TIFF block
{
    unsigned char p[8];
    uint64_t at = 8;
    for (int i = 0; i < 20 && fs_ifd_read_at(file, at, p, 8); i++) {
        uint64_t size = big32(p + 4);
        if (size > file->size - at - 8) return;
        Block inside = part(file, at + 8, size);
        if (memcmp(p, "\0TTW", 4) == 0) read_block(&inside, info);
        at += 8 + size;
    }
}

// One level of boxes of an ISO media file. Canon keeps TIFF blocks in CMT1 (as the first directory) and CMT2 (EXIF),
// inside moov / uuid.
static void read_boxes(const Block *block, int depth, ExifInfo *info)
{
    static const unsigned char canon[16] = {0x85, 0xc0, 0xb6, 0x87, 0x82, 0x0f, 0x11, 0xe0,
                                            0x81, 0x11, 0xf4, 0xce, 0x46, 0x2b, 0x6a, 0x48};
    unsigned char p[16];
    char type[4];
    Block inside;
    uint64_t at = 0, next;
    for (int i = 0; i < 200 && fs_boxes_at(block, at, &inside, type, &next); i++, at = next) {
        if (memcmp(type, "moov", 4) == 0 && depth == 0) {
            read_boxes(&inside, 1, info);
        } else if (memcmp(type, "uuid", 4) == 0 && depth == 1 && inside.size > 16 &&
                   fs_ifd_read_at(&inside, 0, p, 16) && memcmp(p, canon, 16) == 0) {
            Block boxes = part(&inside, 16, inside.size - 16);
            read_boxes(&boxes, 2, info);
        } else if (depth == 2 && (memcmp(type, "CMT1", 4) == 0 || memcmp(type, "CMT2", 4) == 0)) {
            read_block(&inside, info);
        }
    }
}

static int read_file(const char *path, ExifInfo *info, FsError *err)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // of a pipe nobody writes to
    if (fd < 0) return fs_error_input(err, "%s: cannot open: %s", path, strerror(errno));
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode)) {
        close(fd);
        return fs_error_input(err, "%s: not a regular file", path);
    }
    Block file = {.fd = fd, .size = (uint64_t)st.st_size};
    unsigned char p[16];
    if (fs_ifd_read_at(&file, 0, p, sizeof p)) {
        if (memcmp(p, "\xff\xd8\xff", 3) == 0)
            read_jpeg(&file, info);
        else if (memcmp(p, "\x89PNG\r\n\x1a\n", 8) == 0)
            read_png(&file, info);
        else if (memcmp(p, "FUJIFILMCCD-RAW ", 16) == 0)
            read_raf(&file, info);
        else if (memcmp(p, "\0MRM", 4) == 0)
            read_mrw(&file, info);
        else if (memcmp(p + 4, "ftypcrx ", 8) == 0)
            read_boxes(&file, 0, info);
        else if (fs_heif_is(p))
            fs_heif_read_exif(path, info);
        else
            fs_ifd_read(&file, info);
    }
    close(fd);
    return 0;
}

int fs_exif_read(const char *path, ExifInfo *info, FsError *err)
{
    *info = (ExifInfo){.flash = -1, .orientation = 1};
    return read_file(path, info, err);
}

int fs_exif_read_tags(const char *path, Tags *tags, FsError *err)
{
    *tags = (Tags){0};
    ExifInfo info = {.tags = tags};
    return read_file(path, &info, err);
}

int fs_exif_flash_fired(const ExifInfo *info)
{
    return info->flash < 0 ? -1 : info->flash & 1;
}

void fs_exif_shutter_text(double exposure_s, char text[24])
{
    if (exposure_s > 0 && exposure_s < 0.3)
        snprintf(text, 24, "1/%.0f s", 1 / exposure_s);
    else
        snprintf(text, 24, "%.3g s", exposure_s);
}

void fs_exif_exposure_text(const ExifInfo *info, char text[120])
{
    char shutter[24] = "exposure unknown", iso[32] = "ISO unknown", aperture[32] = "aperture unknown";
    if (info->exposure_s > 0) fs_exif_shutter_text(info->exposure_s, shutter);
    if (info->iso > 0) snprintf(iso, sizeof iso, "ISO %.0f", info->iso);
    if (info->f_number > 0) snprintf(aperture, sizeof aperture, "f/%.3g", info->f_number);
    snprintf(text, 120, "%s, %s, %s", shutter, iso, aperture);
}

double fs_exif_exposure(const ExifInfo *info)
{
    double n = info->f_number > 0 ? info->f_number : 1;
    return info->exposure_s * (info->iso > 0 ? info->iso : 100) / (n * n);
}

double fs_exif_focal_px(const ExifInfo *info, int width, int height)
{
    double longer = width > height ? width : height, diagonal = hypot(width, height);
    double by_35mm = info->focal_35mm / hypot(36, 24) * diagonal, by_plane = 0;
    if (info->focal_mm > 0 && info->pixels_per_mm > 0) {
        int exif_longer = info->exif_width > info->exif_height ? info->exif_width : info->exif_height;
        by_plane = info->focal_mm * info->pixels_per_mm * (exif_longer > 0 ? longer / exif_longer : 1.0);
    }
    // The sensor's resolution is the more exact one, but some programs leave nonsense there.
    bool agree = by_35mm == 0 || (by_plane > 0.8 * by_35mm && by_plane < 1.25 * by_35mm);
    double focal = by_plane > 0 && agree ? by_plane : by_35mm;
    return focal > 0.2 * longer && focal < 50 * longer ? focal : 0;
}

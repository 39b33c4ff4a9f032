// EXIF for JPEG: two little-endian TIFF directories, made from tables.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "synth/photo_file.h"

enum { BYTE = 1, ASCII = 2, SHORT = 3, LONG = 4, RATIONAL = 5, UNDEFINED = 7 };

typedef struct Entry {
    unsigned tag, type;
    const char *text;      // ASCII, UNDEFINED (4 bytes)
    unsigned value, below; // numbers; below: denominator
} Entry;

typedef struct Block {
    unsigned char *data; // starts at the TIFF header
    size_t used;
} Block;

static void put(unsigned char *at, unsigned value, int bytes)
{
    for (int i = 0; i < bytes; i++) at[i] = (unsigned char)(value >> (8 * i));
}

// Writes a directory at b->used, long values after it; returns where it starts.
static size_t directory(Block *b, const Entry *entry, int n)
{
    size_t start = b->used, long_values = start + 2 + 12 * (size_t)n + 4;
    put(b->data + start, (unsigned)n, 2);
    for (int i = 0; i < n; i++) {
        const Entry *e = &entry[i];
        unsigned char *at = b->data + start + 2 + 12 * (size_t)i;
        size_t count = e->type == ASCII ? strlen(e->text) + 1 : e->type == UNDEFINED ? 4 : 1;
        put(at, e->tag, 2);
        put(at + 2, e->type, 2);
        put(at + 4, (unsigned)count, 4);
        if ((e->type == ASCII && count > 4) || e->type == RATIONAL) {
            put(at + 8, (unsigned)long_values, 4);
            if (e->type == RATIONAL) {
                put(b->data + long_values, e->value, 4);
                put(b->data + long_values + 4, e->below, 4);
                long_values += 8;
            } else {
                memcpy(b->data + long_values, e->text, count);
                long_values += count + (count & 1);
            }
        } else if (e->type == ASCII || e->type == UNDEFINED) {
            memcpy(at + 8, e->text, count);
        } else {
            put(at + 8, e->value, e->type == SHORT ? 2 : 4);
        }
    }
    b->used = long_values;
    return start;
}

void fs_photo_file_time(const ShotInfo *info, char text[20])
{
    unsigned s = 6u * (unsigned)info->number;
    snprintf(text, 20, "2024:03:16 %02u:%02u:%02u", 10 + s / 3600 % 12, s / 60 % 60, s % 60);
}

size_t fs_photo_file_exif(const ShotInfo *info, unsigned char block[FS_PHOTO_FILE_EXIF])
{
    char time[20];
    fs_photo_file_time(info, time);
    memset(block, 0, FS_PHOTO_FILE_EXIF);
    memcpy(block, "Exif\0\0II*\0\10\0\0\0", 14);
    Block b = {block + 6, 8};
    Entry main[] = {
        {0x010f, ASCII, SHOT_MAKE, 0, 0},     {0x0110, ASCII, SHOT_MODEL, 0, 0}, {0x0112, SHORT, NULL, 1, 0},
        {0x011a, RATIONAL, NULL, 72, 1},      {0x011b, RATIONAL, NULL, 72, 1},   {0x0128, SHORT, NULL, 2, 0},
        {0x0131, ASCII, SHOT_SOFTWARE, 0, 0}, {0x0132, ASCII, time, 0, 0},       {0x8769, LONG, NULL, 0, 0},
    };
    const Entry shot[] = {
        {0x829a, RATIONAL, NULL, 1, (unsigned)info->exposure.shutter},
        {0x829d, RATIONAL, NULL, (unsigned)lround(10 * info->exposure.f_number), 10},
        {0x8822, SHORT, NULL, 1, 0}, // exposure set by hand
        {0x8827, SHORT, NULL, (unsigned)info->exposure.iso, 0},
        {0x9000, UNDEFINED, "0230", 0, 0},
        {0x9003, ASCII, time, 0, 0},
        {0x9004, ASCII, time, 0, 0},
        {0x9101, UNDEFINED, "\1\2\3\0", 0, 0},
        {0x9209, SHORT, NULL, info->flash ? 9 : 16, 0}, // fired, compulsory; or suppressed
        {0x920a, RATIONAL, NULL, (unsigned)lround(100 * info->focal_mm), 100},
        {0xa000, UNDEFINED, "0100", 0, 0},
        {0xa001, SHORT, NULL, 1, 0},
        {0xa002, LONG, NULL, (unsigned)info->width, 0},
        {0xa003, LONG, NULL, (unsigned)info->height, 0},
        {0xa402, SHORT, NULL, 1, 0},
        {0xa403, SHORT, NULL, !info->exposure.automatic, 0},
        {0xa405, SHORT, NULL, (unsigned)info->focal_35mm, 0},
    };
    const int n = (int)(sizeof main / sizeof *main);
    directory(&b, main, n);
    main[n - 1].value = (unsigned)b.used; // now known: where the second directory starts
    b.used = 8;
    directory(&b, main, n);
    directory(&b, shot, (int)(sizeof shot / sizeof *shot));
    return b.used + 6;
}

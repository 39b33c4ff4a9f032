// TIFF directories: the tags about the shot out of a TIFF block, wherever in a file that block lies.
#pragma once

#include "image/exif.h"

// A part of an open file, or of memory; offsets count from its first byte.
typedef struct Block {
    int fd;
    uint64_t start, size;
    const unsigned char *memory; // NULL: the file
} Block;

bool fs_ifd_read_at(const Block *block, uint64_t offset, void *to, size_t n); // false when not all of it is there
// Reads the first directory and its EXIF directory into info; keeps what other blocks gave. False when the block is
// not TIFF. Damaged or unknown entries are left out.
bool fs_ifd_read(const Block *block, ExifInfo *info);
// Bytes of picture data that the directories promise and the block does not hold, of all of it.
typedef struct IfdMissing {
    uint64_t missing, all;
    unsigned looks; // that were taken
    bool dng;
} IfdMissing;
IfdMissing fs_ifd_missing(const Block *block);

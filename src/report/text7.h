// Bytes as a string of JavaScript, in a file that is read the same way in every encoding a browser may take it for:
// deflated (zlib's format), then seven bits a character, lowest first, from the lowest bit of each byte on. That is
// 1.19 bytes a byte, where base64 has 1.33.
#pragma once

#include <stddef.h>
#include <stdio.h>

#include "base/error.h"

// The string with its quotes. Chunks in order are taken as one run of bytes.
typedef struct TextChunk {
    const unsigned char *byte;
    size_t n;
} TextChunk;
int fs_text7_write(FILE *f, const TextChunk *chunk, int chunks, FsError *err);

// 256 numbers that stand for many: the nearest ones by least squares (Lloyd's algorithm in one dimension).
#pragma once

#include "base/error.h"

enum { CODEBOOK = 256 };

// Rising numbers for the n values. Memory for n floats is taken.
int fs_codebook_make(const float *value, size_t n, float codebook[CODEBOOK], FsError *err);
unsigned char fs_codebook_nearest(const float codebook[CODEBOOK], float value);

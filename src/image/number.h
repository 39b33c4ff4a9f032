// Numbers as binary files hold them.
#pragma once

#include <stdbool.h>

// kind: 'i' signed, 'u' unsigned (1, 2, 4 bytes), 'f' floating point (2, 4, 8 bytes). swapped: in the other byte order
// than this machine's.
double fs_number_read(const char *at, char kind, int size, bool swapped);

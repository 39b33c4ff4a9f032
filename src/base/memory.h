// Memory that runs out under a call that could go on without it (a picture left out, a key of a JSON object, a tag of a
// file) ends with FS_ERR_MEMORY all the same: never with another result. For the public calls.
#pragma once

#include <stddef.h>

#include "base/error.h"

unsigned fs_memory_begin(void);                          // returns how often memory has run out so far
int fs_memory_end(unsigned begun, int rc, FsError *err); // rc, or FS_ERR_MEMORY where memory ran out since `begun`

// Room for one more at the end of an array (given by its address) of n elements, which grows at powers of two.
int fs_memory_grow(void *array, int n, size_t size, FsError *err);

// Whether a RAW file is all there: decoders fill what is cut off with whatever memory held.
#pragma once

#include "base/error.h"

// FS_ERR_INPUT where the file ends before the data that its own directories tell of; 0 too where they tell nothing.
int fs_extent_check(const char *path, FsError *err);

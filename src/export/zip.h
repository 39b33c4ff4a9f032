// A ZIP archive of files that are stored as they are, without times.
#pragma once

#include "base/file.h"

typedef struct ZipEntry {
    const char *name;
    void *data; // the owner's to free()
    size_t size;
} ZipEntry;

// FS_ERR_INPUT when it would be larger than a ZIP can be (4 GiB).
int fs_zip_write(const ZipEntry *entry, int n, const char *path, FsError *err);

// libtiff on our own files: it reads and writes through an AtomicFile, and what it says becomes an error.
#pragma once

#include <tiffio.h>

#include "base/file.h"

typedef struct TiffFile {
    const char *path;
    TIFF *tiff;
    char why[300];   // what libtiff said first
    AtomicFile file; // when writing
} TiffFile;

// t must not move while it is open. mode: libtiff's, without the first letter.
int fs_tiff_file_read(TiffFile *t, const char *path, FsError *err);
int fs_tiff_file_begin(TiffFile *t, const char *path, const char *mode, FsError *err);
int fs_tiff_file_commit(TiffFile *t, bool ok, FsError *err); // ok: all that was written succeeded; frees either way
void fs_tiff_file_close(TiffFile *t);                        // after reading
int fs_tiff_file_bad(const TiffFile *t, FsError *err);       // when reading failed

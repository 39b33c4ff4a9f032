// Photos for the tests: the folder that OpenCV and exiftool filled (tests/data/photos/make.py), a scratch folder,
// and small files made on the spot.
#ifndef TESTS_PHOTOS_H
#define TESTS_PHOTOS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/file.h"
#include "image/raw.h"
#include "temp_dir.h"

static char *scratch;

static inline char *given(const char *name) // one at a time
{
    static char path[500];
    snprintf(path, sizeof path, "%s/%s", PHOTOS, name);
    return path;
}

static inline char *temp(const char *name) // one at a time
{
    static char path[500];
    snprintf(path, sizeof path, "%s/%s", scratch, name);
    return path;
}

static inline int make_scratch(void **state)
{
    if (temp_dir_make(state) < 0) return -1;
    scratch = *state;
    return 0;
}

static inline int drop_scratch(void **state)
{
    return temp_dir_remove(state);
}

static inline int read_whole(const char *path, const double white_balance[3], bool plain, Image picture[2],
                             FsError *err)
{
    PhotoSizes sizes = {.n = 1};
    int rc = fs_raw_read(path, white_balance, plain, &sizes, err);
    picture[0] = sizes.size[0].rgb;
    picture[1] = sizes.size[0].clipped;
    return rc;
}

static inline void copy_photo(const char *from, const char *to) // from PHOTOS to the scratch folder
{
    char *data;
    size_t size;
    assert_int_equal(fs_file_read(given(from), 1 << 20, &data, &size, NULL), 0);
    FILE *f = fopen(temp(to), "wb"); // fs_file_write takes no name as long as the system does
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    free(data);
}

#endif

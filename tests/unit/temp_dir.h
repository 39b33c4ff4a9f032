// A temporary folder for one test.
#ifndef FS_TESTS_TEMP_DIR_H
#define FS_TESTS_TEMP_DIR_H

#include <stdlib.h>

#include "base/file.h"

// setup / teardown for cmocka: *state is the folder's path.
static inline int temp_dir_make(void **state)
{
    const char *base = getenv("TMPDIR");
    char *dir = fs_file_path("%s/flashsplat-test-XXXXXX", base && *base ? base : "/tmp");
    if (!dir || !mkdtemp(dir)) return -1;
    *state = dir;
    return 0;
}

static inline int temp_dir_remove(void **state)
{
    fs_file_remove_tree(*state);
    free(*state);
    return 0;
}

#endif

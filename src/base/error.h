// Errors: a fallible function returns 0 or a negative FsStatus and fills FsError once.
#ifndef FS_BASE_ERROR_H
#define FS_BASE_ERROR_H

#include "flashsplat.h"

// Forwards a failure to the `fail:` label of a function that has `int rc`.
#define TRY(call)                                                                                                      \
    do {                                                                                                               \
        if ((rc = (call)) < 0) goto fail;                                                                              \
    } while (0)

// Fills err (may be NULL) and returns code, so that a caller can `return fs_error(...)`.
__attribute__((format(printf, 3, 4))) int fs_error_set(FsError *err, int code, const char *format, ...);
int fs_error_memory(FsError *err);       // FS_ERR_MEMORY with the usual words
unsigned fs_error_memory_failures(void); // how often memory ran out in this process; see base/memory.h

#endif

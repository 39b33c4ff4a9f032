// Errors: a fallible function returns 0 or a negative FsStatus and fills FsError once.
#pragma once

#include "flashsplat.h"

// Forwards a failure to the `fail:` label of a function that has `int rc`.
#define TRY(call)                                                                                                      \
    do {                                                                                                               \
        if ((rc = (call)) < 0) goto fail;                                                                              \
    } while (0)

// Forwards a failure at once, from where nothing is to be released.
#define MUST(call)                                                                                                     \
    do {                                                                                                               \
        int rc_ = (call);                                                                                              \
        if (rc_ < 0) return rc_;                                                                                       \
    } while (0)

// Fills err (may be NULL) and returns code, so that a caller can `return fs_error_set(...)`.
__attribute__((format(printf, 3, 4))) int fs_error_set(FsError *err, int code, const char *format, ...);
// The same for the commonest code: a file or folder that is missing or wrong.
#define fs_error_input(err, ...) fs_error_set(err, FS_ERR_INPUT, __VA_ARGS__)
int fs_error_memory(FsError *err);                                  // FS_ERR_MEMORY with the usual words
int fs_error_first(const FsError *failure, size_t n, FsError *err); // of n jobs' failures, {0} where there was none
int fs_error_about(int rc, const char *what,
                   FsError *err); // rc; where it is a failure, "what: " goes before err's words
int fs_error_then(int rc, const char *remedy, FsError *err); // rc; of wrong input, "; remedy" goes after err's words
unsigned fs_error_memory_failures(void); // how often memory ran out in this process; see base/memory.h

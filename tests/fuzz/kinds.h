// The kinds of input that come from outside, each as one function for the fuzzer (fuzz.c) and for the replay of the
// corpora (replay.c). tests/fuzz/README.md says how to add one.
#ifndef FS_TESTS_KINDS_H
#define FS_TESTS_KINDS_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

#define FUZZ_PARTS 6

typedef struct FuzzKind {
    const char *name;
    const char *part[FUZZ_PARTS];               // the files an input holds, in the folder that read gets; in the
                                                // input they are parted by lines of "====="
    int (*read)(const char *dir, FsError *err); // 0 taken, negative refused
    bool quiet;                                 // a refusal need not name a file (there is no message)
} FuzzKind;

extern const FuzzKind fuzz_kinds[];
extern const int fuzz_n_kinds;

const FuzzKind *fuzz_kind(const char *name); // NULL when there is none of that name
// Writes the input's parts and reads them. A reader may take or refuse what it gets; aborts when it breaks a promise: a
// refusal is one line that names a file, what is taken is finite and within bounds.
int fuzz_run(const FuzzKind *kind, const uint8_t *data, size_t size, FsError *err);

#endif

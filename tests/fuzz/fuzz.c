// The entry of clang's libFuzzer: `fuzz --kind=ply CORPUS...`.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kinds.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const FuzzKind *kind;

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    for (int i = 1; i < *argc; i++)
        if (strncmp((*argv)[i], "--kind=", 7) == 0) kind = fuzz_kind((*argv)[i] + 7);
    if (kind) return 0;
    fprintf(stderr, "--kind=NAME is missing; there are");
    for (int i = 0; i < fuzz_n_kinds; i++) fprintf(stderr, " %s", fuzz_kinds[i].name);
    fprintf(stderr, "\n");
    exit(2);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    FsError err = {0};
    fuzz_run(kind, data, size, &err);
    return 0;
}

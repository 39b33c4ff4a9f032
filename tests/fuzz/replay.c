// Replays the corpora that the fuzzers found: every input must be survived, and those named sound* must be taken.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "base/file.h"
#include "kinds.h"

static int replay_file(const FuzzKind *kind, const char *path, const char *name)
{
    char *data;
    size_t size;
    FsError err = {0};
    if (fs_file_read(path, 1 << 24, &data, &size, &err) < 0) {
        printf("%s\n", err.message);
        return 1;
    }
    int rc = fuzz_run(kind, (const uint8_t *)data, size, &err);
    free(data);
    if (rc == 0 || strncmp(name, "sound", 5) != 0) return 0;
    printf("%s: sound, but refused: %s\n", path, err.message);
    return 1;
}

static int replay_kind(const FuzzKind *kind, const char *corpora)
{
    char *dir = fs_file_path("%s/%s", corpora, kind->name);
    FileList list = {0};
    FsError err = {0};
    int failed = 0, sound = 0;
    if (fs_file_list(dir, &list, &err) < 0) printf("%s\n", err.message), failed = 1;
    for (int i = 0; i < list.n; i++) {
        char *path = fs_file_path("%s/%s", dir, list.name[i]);
        sound += strncmp(list.name[i], "sound", 5) == 0;
        failed += replay_file(kind, path, list.name[i]);
        free(path);
    }
    if (!sound) printf("%s: no input named sound*, so nothing shows that its reader reads\n", dir), failed++;
    printf("%-14s %3d inputs, %d sound, %d failed\n", kind->name, list.n, sound, failed);
    fs_file_list_free(&list);
    free(dir);
    return failed;
}

int main(int argc, char **argv)
{
    if (argc != 2) return 2;
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__ && !defined __clang__
    // a header that lies must not take the machine's memory either
    setrlimit(RLIMIT_AS, &(struct rlimit){(rlim_t)2 << 30, (rlim_t)2 << 30});
#endif
    int failed = 0;
    for (int i = 0; i < fuzz_n_kinds; i++) failed += replay_kind(&fuzz_kinds[i], argv[1]);
    return failed ? 1 : 0;
}

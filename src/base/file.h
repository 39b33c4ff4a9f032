// Files: whole reads with a size limit, writes that appear whole or not at all, names and folders.
#ifndef FS_BASE_FILE_H
#define FS_BASE_FILE_H

#include <stdio.h>

#include "base/error.h"

// Reads a whole file (a 0 byte is appended, not counted). *data is the caller's to free().
int fs_file_read(const char *path, size_t max_size, char **data, size_t *size, FsError *err);
// Writes a whole file under a temporary name beside it, then renames.
int fs_file_write(const char *path, const void *data, size_t size, FsError *err);

// The same for a stream: begin, write to f, then commit (checks every write, syncs, renames) or abort.
typedef struct AtomicFile {
    FILE *f;
    char *path, *temp;
} AtomicFile;
int fs_file_begin(AtomicFile *file, const char *path, FsError *err);
int fs_file_commit(AtomicFile *file, FsError *err); // frees either way
void fs_file_abort(AtomicFile *file);               // frees; harmless on {0} or after commit
// For libraries that open a path themselves: a temporary name beside path, caller frees; then rename it.
char *fs_file_temp(const char *path);
int fs_file_rename(const char *temp, const char *path, FsError *err); // removes temp on failure

int fs_file_mkdirs(const char *path, FsError *err); // like mkdir -p
bool fs_file_exists(const char *path);
bool fs_file_is_dir(const char *path);
void fs_file_remove_tree(const char *path);

__attribute__((format(printf, 1, 2))) char *fs_file_path(const char *format, ...); // asprintf; NULL when out of memory
const char *fs_file_name(const char *path);                                        // after the last '/'
char *fs_file_stem(const char *path);                    // name without folder and extension; caller frees
bool fs_file_has_ext(const char *path, const char *ext); // case-insensitive, ext without dot

typedef struct FileList {
    char **name; // sorted names without folder, "." and hidden ones left out
    int n;
} FileList;
int fs_file_list(const char *dir, FileList *list, FsError *err);
void fs_file_list_free(FileList *list);

#endif

// Files: whole reads with a size limit, writes that appear whole or not at all, names and folders.
#pragma once

#include <stdio.h>

#include "base/error.h"

// Opens a regular file to read; refuses anything else at once: a pipe, say, that nobody writes to. *f: NULL then.
int fs_file_open(const char *path, FILE **f, FsError *err);
// Reads a whole file (a 0 byte is appended, not counted). *data is the caller's to free().
int fs_file_read(const char *path, size_t max_size, char **data, size_t *size, FsError *err);
// Writes a whole file under a temporary name, then renames. A user's file is not overwritten (owned.h).
int fs_file_write(const char *path, const void *data, size_t size, FsError *err);

// The same for a stream: begin, write to f (or with fs_file_put), then commit or abort. The struct must not move
// between. Whatever a library does in between, commit knows the first write that failed and why.
typedef struct AtomicFile {
    FILE *f; // buffered; what is put is not
    int fd;
    int error; // errno of the first write that failed
    char *path, *temp;
} AtomicFile;
int fs_file_begin(AtomicFile *file, const char *path, FsError *err);
long fs_file_put(AtomicFile *file, const void *data, size_t size); // at fd's place; fewer bytes than size: failed
int fs_file_commit(AtomicFile *file, FsError *err);                // syncs and renames; frees either way
void fs_file_abort(AtomicFile *file);                              // frees; harmless on {0} or after commit
// When a library failed to write: the disk's reason, or the library's, with FS_ERR_IO (FS_ERR_MEMORY for ENOMEM).
int fs_file_failed(const AtomicFile *file, const char *why, FsError *err);
void fs_file_remove(const char *path);                                // one file, where there is one; for owned.c
int fs_file_rename(const char *temp, const char *path, FsError *err); // a file or a folder; removes temp on failure
// Files are on the disk once they have their names; the names are after this call. Before a done mark.
int fs_file_sync_names(FsError *err);

// The same bytes under another name: a link where the file system can, else a copy.
int fs_file_link(const char *from, const char *path, FsError *err);
int fs_file_append(const char *path, const char *text, FsError *err); // whole or not at all

int fs_file_mkdirs(const char *path, FsError *err); // like mkdir -p
// The length of path up to the first folder of it that is not there; 0 where all is.
size_t fs_file_missing(const char *path);
bool fs_file_exists(const char *path);
bool fs_file_is_dir(const char *path);
bool fs_file_is_read_only(const char *path);               // is there, and may not be written to
bool fs_file_is_older(const char *path, const char *than); // where both are there
void fs_file_remove_tree(const char *path); // whatever it is: for scratch and tests, the rest takes fs_owned_remove

// A path put together, at its place: fs_file_at("%s/views.json", out).text. One longer than the system takes stays so:
// what opens it fails and says why.
typedef struct FilePath {
    char text[4200];
} FilePath;
__attribute__((format(printf, 1, 2))) FilePath fs_file_at(const char *format, ...);
__attribute__((format(printf, 1, 2))) char *fs_file_path(const char *format, ...); // asprintf; NULL when out of memory
const char *fs_file_name(const char *path);                                        // after the last '/'
char *fs_file_stem(const char *path);                    // name without folder and extension; the caller frees
bool fs_file_has_ext(const char *path, const char *ext); // one of "jpg jpeg", of any case

typedef struct FileList {
    char **name; // sorted names without folder, "." and hidden ones left out
    int n;
} FileList;
int fs_file_list(const char *dir, FileList *list, FsError *err); // the caller's (fs_file_list_free)
// The whole path of a name, which may lead nowhere: without links as far as it is there.
FilePath fs_file_whole(const char *name);
void fs_file_list_free(FileList *list);
// The last file of a folder with an extension, by the number that its name begins with, then by name; false: none.
bool fs_file_last(const char *dir, const char *ext, FilePath *path);

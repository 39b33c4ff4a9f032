// JSON files, read and written whole.
#pragma once

#include <jansson.h>

#include "base/error.h"

int fs_json_file_read(const char *path, size_t max_size, json_t **root, FsError *err); // the caller's; NULL on failure
// Takes over root; NULL, or what cannot be JSON, is an error. flags: of json_dumps.
int fs_json_file_write(const char *path, json_t *root, size_t flags, FsError *err);
// 0 when path may be written: nothing is there, or a file of ours (owned.h) that holds an object, or a
// list whose first is one, with that key.
int fs_json_file_check(const char *path, const char *key, FsError *err);
json_t *fs_json_file_floats(const float *x, int n); // (n) as a list; NULL when out of memory
json_t *fs_json_file_doubles(const double *x, int n);
// The first three rows of a list of rows of four numbers; false where there are none such.
bool fs_json_file_matrix(const json_t *rows, double m[12]);

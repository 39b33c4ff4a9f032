// JSON files, read and written whole.
#pragma once

#include <jansson.h>

#include "base/error.h"

int fs_json_file_read(const char *path, size_t max_size, json_t **root, FsError *err); // NULL on failure
// Takes over root; NULL, or what cannot be JSON, is an error. flags: of json_dumps.
int fs_json_file_write(const char *path, json_t *root, size_t flags, FsError *err);
// The first three rows of a list of rows of four numbers; false where there are none such.
bool fs_json_file_matrix(const json_t *rows, double m[12]);

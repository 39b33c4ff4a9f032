#include "base/json_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"

int fs_json_file_read(const char *path, size_t max_size, json_t **root, FsError *err)
{
    char *text;
    size_t size;
    json_error_t at;
    *root = NULL;
    MUST(fs_file_read(path, max_size, &text, &size, err));
    *root = json_loadb(text, size, 0, &at);
    free(text);
    return *root ? 0 : fs_error_input(err, "%s: line %d: not JSON: %s", path, at.line, at.text);
}

int fs_json_file_write(const char *path, json_t *root, size_t flags, FsError *err)
{
    char *text = root ? json_dumps(root, flags) : NULL;
    json_decref(root);
    if (!text) return fs_error_set(err, FS_ERR_IO, "%s: cannot write: a name is not UTF-8, or memory is out", path);
    int rc = fs_file_write(path, text, strlen(text), err);
    free(text);
    return rc;
}

int fs_json_file_check(const char *path, const char *key, FsError *err)
{
    json_t *root = NULL;
    MUST(fs_owned_check(path, err));
    if (!fs_file_exists(path)) return 0;
    fs_json_file_read(path, (size_t)1 << 30, &root, NULL);
    bool other = !json_object_get(json_is_array(root) ? json_array_get(root, 0) : root, key);
    json_decref(root);
    return other ? fs_error_input(err, "%s: is in the way: it holds something else; name another file", path) : 0;
}

bool fs_json_file_matrix(const json_t *rows, double m[12])
{
    for (size_t i = 0; i < 12; i++) {
        const json_t *v = json_array_get(json_array_get(rows, i / 4), i % 4);
        m[i] = json_number_value(v);
        if (!json_is_number(v) || !isfinite(m[i])) return false;
    }
    return true;
}

json_t *fs_json_file_floats(const float *x, int n)
{
    json_t *list = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(list, json_real((double)x[i]));
    return list;
}

json_t *fs_json_file_doubles(const double *x, int n)
{
    json_t *list = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(list, json_real(x[i]));
    return list;
}

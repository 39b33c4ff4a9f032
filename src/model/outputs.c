#include "model/outputs.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "model/layers.h"
#include "model/project.h"

#define MAX_INGESTED ((size_t)256 << 20)

// ---- names ----

int fs_outputs_names(OutputNames *names, const char *out, FsError *err)
{
    *names = (OutputNames){0};
    FilePath path = fs_file_at("%s/ingest.json", out);
    if (!fs_file_exists(path.text) || fs_json_file_read(path.text, MAX_INGESTED, &names->ingested, NULL) < 0) return 0;
    const json_t *photos = json_object_get(names->ingested, "photos");
    const char **view = calloc(json_array_size(photos) + 1, sizeof *view);
    if (!view) {
        fs_outputs_free(names);
        return fs_error_memory(err);
    }
    for (size_t i = 0; i < json_array_size(photos); i++) {
        const char *name = json_string_value(json_object_get(json_array_get(photos, i), "name"));
        if (name) view[names->n++] = name;
    }
    names->view = view;
    return 0;
}

void fs_outputs_free(OutputNames *names)
{
    if (names->ingested) free((void *)names->view);
    json_decref(names->ingested);
    *names = (OutputNames){0};
}

// ---- the walk ----

typedef struct Walk {
    const OutputNames *names;
    int (*visit)(const char *path, struct Walk *walk, FsError *err);
    int found;
} Walk;

static int visit_one(const char *dir, const char *before, int n_before, const char *name, Walk *walk, FsError *err)
{
    return walk->visit(fs_file_at("%s/%.*s%s", dir, n_before, before, name).text, walk, err);
}

// The files of a folder that a pattern without folder means.
static int walk_files(const char *dir, const char *leaf, Walk *walk, FsError *err)
{
    int rc = 0, at = (int)strcspn(leaf, "%&*");
    FileList list = {0};
    const char *after = leaf + at + (leaf[at] != 0);
    if (leaf[at] == '%') {
        for (int i = 0; i < walk->names->n && rc == 0; i++)
            rc = visit_one(dir, leaf, at, fs_file_at("%s%s", walk->names->view[i], after).text, walk, err);
    } else if (leaf[at] == '&') {
        for (int l = 0; l < LAYERS && rc == 0; l++)
            rc = visit_one(dir, leaf, at, fs_file_at("%s%s", fs_layers[l].name, after).text, walk, err);
    } else {
        rc = visit_one(dir, leaf, at, leaf + at, walk, err); // of a pattern: whether a folder is a link
        if (leaf[at] && fs_file_list(dir, &list, NULL) < 0) list.n = 0;
        for (int i = 0; i < list.n && rc == 0; i++) {
            size_t n = strlen(list.name[i]), m = strlen(after);
            if (n >= m + (size_t)at && strncmp(list.name[i], leaf, (size_t)at) == 0 &&
                strcmp(list.name[i] + n - m, after) == 0)
                rc = visit_one(dir, list.name[i], (int)n, "", walk, err);
        }
        fs_file_list_free(&list);
    }
    return rc;
}

static int walk_pattern(const char *out, const char *pattern, Walk *walk, FsError *err)
{
    pattern += *pattern == '=';
    const char *leaf = fs_file_name(pattern), *star = strstr(pattern, "*/");
    size_t n = (size_t)((star ? star : leaf) - pattern);
    FilePath dir = fs_file_at("%s%s%.*s", out, n ? "/" : "", (int)(n ? n - 1 : 0), pattern);
    FileList list = {0};
    if (!star) return walk_files(dir.text, leaf, walk, err);
    int rc = visit_one(dir.text, star, 1, "", walk, err);
    if (rc == 0 && fs_file_list(dir.text, &list, NULL) < 0) list.n = 0;
    for (int i = 0; i < list.n && rc == 0; i++) {
        FilePath folder = fs_file_at("%s/%s", dir.text, list.name[i]);
        if (fs_file_is_dir(folder.text)) rc = walk_files(folder.text, leaf, walk, err);
    }
    fs_file_list_free(&list);
    return rc;
}

// ---- what is done with each file ----

static int check(const char *path, Walk *walk, FsError *err)
{
    (void)walk;
    return fs_owned_check(path, err);
}

int fs_outputs_check(const char *out, const char *pattern, const OutputNames *names, FsError *err)
{
    return walk_pattern(out, pattern, &(Walk){.names = names, .visit = check}, err);
}

static int count(const char *path, Walk *walk, FsError *err)
{
    (void)err;
    walk->found += fs_file_exists(path);
    return 0;
}

json_t *fs_outputs_count(const char *out, const char *const *patterns, FsError *err)
{
    OutputNames names;
    if (fs_outputs_names(&names, out, err) < 0) return NULL;
    json_t *counts = json_object();
    for (int i = 0; counts && i < PROJECT_OUTPUTS && patterns[i]; i++) {
        Walk walk = {.names = &names, .visit = count};
        walk_pattern(out, patterns[i], &walk, NULL);
        if (!walk.found || json_object_set_new(counts, patterns[i], json_integer(walk.found)) == 0) continue;
        json_decref(counts);
        counts = NULL;
    }
    fs_outputs_free(&names);
    if (!counts) fs_error_memory(err);
    return counts;
}

bool fs_outputs_are_there(const char *out, const char *const *patterns, const json_t *was)
{
    json_t *now = was ? fs_outputs_count(out, patterns, NULL) : NULL, *files;
    bool there = true;
    const char *pattern;
    json_object_foreach((json_t *)was, pattern, files)
    {
        there &= json_integer_value(files) <= json_integer_value(json_object_get(now, pattern));
    }
    json_decref(now);
    return there;
}

// Runs the stage ingest on a folder of given photos, for the tests of what it makes and says.
#ifndef TESTS_INGEST_RUN_H
#define TESTS_INGEST_RUN_H

#include "photos.h"
#include "said.h"

#include <jansson.h>

static int polls_left = 1000000;

static bool on_poll(void *user)
{
    (void)user;
    return --polls_left < 0;
}

// Runs ingest on <scratch>/<photos> with "name=value" settings.
static inline int ingest(const char *photos, const char *const settings[], FsError *err)
{
    FsSettings *set = fs_settings_new();
    FsProject *project;
    FsCallbacks callbacks = {.log = said_keep, .cancelled = on_poll};
    for (; settings && *settings; settings++) {
        char name[40];
        const char *equals = strchr(*settings, '=');
        snprintf(name, sizeof name, "%.*s", (int)(equals - *settings), *settings);
        assert_int_equal(fs_settings_set(set, name, equals + 1, NULL), 0);
    }
    said_forget();
    assert_int_equal(fs_project_open(&project, temp("out"), set, &callbacks, NULL), 0);
    *err = (FsError){0};
    int rc = fs_ingest(project, temp(photos), err);
    assert_null(strchr(err->message, '\n'));
    fs_project_close(project);
    fs_settings_free(set);
    return rc;
}

static inline void expect_error(const char *photos, const char *const settings[], const char *words)
{
    FsError err;
    if (ingest(photos, settings, &err) != FS_ERR_INPUT || !strstr(err.message, words))
        fail_msg("expected an error with '%s', got '%s'", words, err.message);
}

static inline void expect_good(const char *photos, const char *const settings[], const char *words)
{
    FsError err;
    if (ingest(photos, settings, &err) != 0) fail_msg("%s", err.message);
    if (words && !strstr(said, words)) fail_msg("expected '%s', it said: %s", words, said);
    assert_true(fs_file_exists(temp("out/done/ingest.json")));
}

static inline void fill(const char *const pairs[][2])
{
    fs_file_remove_tree(temp("photos"));
    fs_file_remove_tree(temp("out"));
    assert_int_equal(fs_file_mkdirs(temp("photos"), NULL), 0);
    for (; pairs && (*pairs)[0]; pairs++) {
        char to[300];
        snprintf(to, sizeof to, "photos/%s", (*pairs)[1]);
        FilePath folder = fs_file_at("%s/%s", scratch, to);
        *strrchr(folder.text, '/') = 0;
        assert_int_equal(fs_file_mkdirs(folder.text, NULL), 0);
        copy_photo((*pairs)[0], to);
    }
}

#define FILL(...) fill((const char *const[][2]){__VA_ARGS__, {NULL, NULL}})
#define SET(...) ((const char *const[]){__VA_ARGS__, NULL})
#define FOUR                                                                                                           \
    {"flash.dng", "A_1.DNG"}, {"ambient.dng", "A_2.DNG"}, {"flash.dng", "A_3.DNG"},                                    \
    {                                                                                                                  \
        "ambient.dng", "A_4.DNG"                                                                                       \
    }

static inline json_t *photo_entry(json_t *root, const char *name)
{
    size_t i;
    json_t *entry;
    json_array_foreach(json_object_get(root, "photos"), i,
                       entry) if (strcmp(json_string_value(json_object_get(entry, "name")), name) == 0) return entry;
    fail_msg("no photo %s", name);
    return NULL;
}

static inline double figure(json_t *entry, const char *key)
{
    return json_number_value(json_object_get(entry, key));
}

#endif

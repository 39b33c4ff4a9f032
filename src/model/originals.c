#include "model/originals.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_file.h"

#define MAX_BYTES (64 << 20)

static FilePath list_path(const FsProject *project)
{
    return fs_file_at("%s/originals.json", project->out);
}

int fs_originals_remember(const FsProject *project, const char *folder, FsError *err)
{
    json_t *was = NULL;
    FilePath path = list_path(project);
    char *whole = realpath(folder, NULL);
    json_t *text = whole ? json_string(whole) : NULL; // NULL: not UTF-8, then --originals has to tell
    int rc = 0;
    if (!whole && errno == ENOMEM) fs_error_memory(NULL);
    if (fs_file_exists(path.text)) fs_json_file_read(path.text, MAX_BYTES, &was, NULL);
    if (text && !json_equal(text, json_object_get(was, "folder")))
        rc = fs_json_file_write(path.text, json_pack("{s:O}", "folder", text), JSON_INDENT(1), err);
    json_decref(text);
    json_decref(was);
    free(whole);
    return rc;
}

int fs_originals_check(const FsProject *project, const char *folder, FsError *err)
{
    json_t *root = NULL;
    int rc = 0;
    if (fs_file_exists(folder)) return 0;
    fs_json_file_read(list_path(project).text, MAX_BYTES, &root, NULL);
    const char *was = json_string_value(json_object_get(root, "folder"));
    if (was && strcmp(fs_file_whole(folder).text, was) != 0)
        rc = fs_error_input(err, "%s: no such folder; the photos in %s are of %s: name that, or a folder that is there",
                            folder, project->out, was);
    json_decref(root);
    return rc;
}

void fs_originals_free(Originals *o)
{
    fs_photos_free(&o->photos);
    free(o->of_view);
    *o = (Originals){0};
}

int fs_originals_folder(const FsProject *project, FilePath *folder, FsError *err)
{
    json_t *root = NULL;
    *folder = fs_file_at("%s", project->set.originals);
    if (*folder->text) return 0;
    fs_json_file_read(list_path(project).text, MAX_BYTES, &root, NULL);
    const char *text = json_string_value(json_object_get(root, "folder"));
    if (text) *folder = fs_file_at("%s", text);
    json_decref(root);
    if (*folder->text) return 0;
    return fs_error_input(err, "%s: does not say where the photos are: tell it with --originals DIR",
                          list_path(project).text);
}

// As ingest read it: which of two files, and brought to which exposure.
static bool find_reading(const json_t *list, PhotoFile *photo)
{
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *read = json_array_get(list, i);
        const char *is = json_string_value(json_object_get(read, "name"));
        const char *file = json_string_value(json_object_get(read, "file"));
        if (!is || strcmp(is, photo->name) != 0) continue;
        bool other = file && photo->instead && strcmp(fs_file_name(file), fs_file_name(photo->file)) != 0;
        if (other && strcmp(fs_file_name(file), fs_file_name(photo->instead)) == 0 && fs_photos_take_instead(photo) < 0)
            return false;
        photo->gain = json_number_value(json_object_get(read, "exposure_gain"));
        return photo->gain > 1e-6 && photo->gain < 1e6;
    }
    return false;
}

static int find_photos(Originals *o, const Dataset *views, const json_t *ingested, FsError *err)
{
    for (int v = 0; v < views->n; v++) {
        int p = 0;
        while (p < o->photos.n && strcmp(o->photos.photo[p].name, views->view[v].name) != 0) p++;
        if (p == o->photos.n)
            return fs_error_input(err,
                                  "%s: the photo %s is not there any more: put it back, or name the folder that has "
                                  "the photos with --originals DIR",
                                  o->photos.folder, views->view[v].name);
        o->of_view[v] = p;
        if (!find_reading(ingested, &o->photos.photo[p]))
            return fs_error_input(err, "ingest.json: has no photo %s: rerun the stage ingest with --force",
                                  views->view[v].name);
    }
    return 0;
}

// Those of .npy photos that ingest ran with.
static void find_levels(const FsProject *project, SensorLevels *levels)
{
    json_t *root = fs_project_mark(project->out, "ingest");
    const json_t *settings = json_object_get(root, "settings");
    const json_t *black = json_object_get(settings, "npy-black"), *white = json_object_get(settings, "npy-white");
    if (json_is_number(black)) levels->black = json_number_value(black);
    if (json_is_number(white)) levels->white = json_number_value(white);
    json_decref(root);
}

int fs_originals_open(Originals *o, const FsProject *project, const Dataset *views, FsError *err)
{
    *o = (Originals){0};
    json_t *root = NULL;
    FilePath folder;
    int rc;
    FsError why = {0};
    TRY(fs_originals_folder(project, &folder, err));
    if ((rc = fs_photos_scan(&o->photos, folder.text, &(Log){0}, &why)) < 0) {
        fs_error_set(err, rc, "%s; --originals DIR says where the photos are now", why.message);
        goto fail;
    }
    o->of_view = calloc((size_t)views->n + 1, sizeof *o->of_view);
    if (!o->of_view) TRY(fs_error_memory(err));
    TRY(fs_json_file_read(fs_file_at("%s/ingest.json", project->out).text, MAX_BYTES, &root, err));
    TRY(fs_photos_levels(&o->photos.npy, &project->set, err));
    find_levels(project, &o->photos.npy);
    double *wb = o->photos.white_balance;
    if (json_unpack(root, "{s:[FFF!]}", "white_balance", &wb[0], &wb[1], &wb[2]) != 0 ||
        !(wb[0] > 1e-3 && wb[1] > 1e-3 && wb[2] > 1e-3 && wb[0] < 1e3 && wb[1] < 1e3 && wb[2] < 1e3))
        TRY(fs_error_input(err, "%s/ingest.json: no white balance: rerun the stage ingest with --force", project->out));
    TRY(find_photos(o, views, json_object_get(root, "photos"), err));
fail:
    json_decref(root);
    if (rc < 0) fs_originals_free(o);
    return rc;
}

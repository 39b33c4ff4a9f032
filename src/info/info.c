// Finds out what kind of thing a path is and has it described.
#include "info/info.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "model/colmap_model.h"
#include "model/scene_folder.h"

static bool holds(const char *dir, const char *name)
{
    return fs_file_exists(fs_file_at("%s/%s", dir, name).text);
}

static int describe_folder(const char *dir, const Log *log, FsError *err)
{
    if (holds(dir, "done/ingest.json") || holds(dir, "ingest.json") || holds(dir, "views.json"))
        return fs_info_project(dir, log, err);
    char *model = fs_colmap_model_find(dir);
    SceneFolder scene;
    bool cameras = model != NULL || holds(dir, "transforms.json") || holds(dir, "poses_bounds.npy");
    free(model);
    if (cameras && !fs_scene_folder_find(&scene, dir)) return fs_info_cameras(dir, log, err);
    FsError why = {0};
    int rc = fs_info_photos(dir, log, &why);
    if (err && rc < 0 && rc != FS_ERR_INPUT) *err = why;
    if (rc != FS_ERR_INPUT) return rc;
    return fs_error_input(err, "%s; nor is it a project folder (flashsplat run PHOTOS -o OUT) or a COLMAP model",
                          why.message);
}

// cameras.bin, images.txt, ... of a COLMAP model: the folder they are in is what to describe.
static bool is_model_part(const char *path)
{
    static const char *const names[] = {"cameras", "images", "points3D"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        size_t n = strlen(names[i]);
        const char *name = fs_file_name(path);
        if (strncmp(name, names[i], n) == 0 && (strcmp(name + n, ".bin") == 0 || strcmp(name + n, ".txt") == 0))
            return true;
    }
    return false;
}

int fs_info_run(const char *path, const Log *log, FsError *err)
{
    if (!fs_file_exists(path)) return fs_error_input(err, "%s: no such file or folder, or it cannot be read", path);
    if (fs_file_is_dir(path)) return describe_folder(path, log, err);
    if (fs_file_has_ext(path, "ply")) return fs_info_ply(path, log, err);
    if (fs_file_has_ext(path, "json") || strcmp(fs_file_name(path), "poses_bounds.npy") == 0)
        return fs_info_cameras(path, log, err);
    if (!is_model_part(path)) return fs_info_photo(path, log, err);
    size_t n = (size_t)(fs_file_name(path) - path); // with the slash
    return fs_info_cameras(n == 0 ? "." : fs_file_at("%.*s", (int)(n > 1 ? n - 1 : n), path).text, log, err);
}

void fs_info_size(double bytes, char *buf, size_t n)
{
    static const char *const units[] = {"bytes", "kB", "MB", "GB", "TB"};
    size_t unit = 0;
    while (bytes >= 1000 && unit + 1 < sizeof units / sizeof *units) {
        bytes /= 1000;
        unit++;
    }
    snprintf(buf, n, unit ? "%.1f %s" : "%.0f %s", bytes, units[unit]);
}

#include "model/scene_folder.h"

#include <stdlib.h>
#include <string.h>

#include "base/owned.h"
#include "image/photo.h"
#include "model/colmap_model.h"

static bool holds(const char *folder, const char *name, FilePath *path)
{
    *path = fs_file_at("%s/%s", folder, name);
    return fs_file_exists(path->text);
}

#define MOST_STRAY 3 // pictures beside the folder of photos that are none of them: previews, renders of the scene

// Photos of the kind wanted (-1: any) right in a folder, or in a subfolder of it.
static int count_photos(const char *folder, const char *below, int wanted)
{
    FileList list = {0};
    int n = 0;
    if (fs_file_list(*below ? fs_file_at("%s/%s", folder, below).text : folder, &list, NULL) < 0) return 0;
    for (int i = 0; i < list.n; i++) {
        int kind = fs_photo_kind(list.name[i]);
        n += wanted < 0 ? kind >= 0 && strcmp(list.name[i], FS_SCENE_FOLDER_BOUNDS) != 0 : kind == wanted;
    }
    fs_file_list_free(&list);
    return n;
}

static void find_poses(SceneFolder *scene, const char *folder)
{
    char *model = fs_colmap_model_find(folder);
    if (model)
        scene->poses = fs_file_at("%s", model);
    else if (!holds(folder, "transforms.json", &scene->poses) && !holds(folder, FS_SCENE_FOLDER_BOUNDS, &scene->poses))
        scene->poses.text[0] = 0;
    free(model);
}

// N_views/dense/fused.ply, of the largest N.
static void find_points(SceneFolder *scene, const char *folder)
{
    FileList list = {0};
    int most = 0;
    FilePath path;
    if (fs_file_list(folder, &list, NULL) < 0) return;
    for (int i = 0; i < list.n; i++) {
        char *end;
        long views = strtol(list.name[i], &end, 10);
        path = fs_file_at("%s/%s/dense/fused.ply", folder, list.name[i]);
        if (strcmp(end, "_views") != 0 || views <= most || views > 100000 || !fs_file_exists(path.text)) continue;
        most = (int)views;
        scene->points = path;
    }
    fs_file_list_free(&list);
}

bool fs_scene_folder_find(SceneFolder *scene, const char *folder)
{
    *scene = (SceneFolder){0};
    bool ours = fs_file_exists(fs_file_at("%s/" FS_OWNED_DIR, folder).text);
    int stray = count_photos(folder, "", -1), n;
    if (ours || stray > MOST_STRAY) return false;
    find_poses(scene, folder);
    if ((n = count_photos(folder, "images_npy", PHOTO_NPY)) > 0)
        scene->photos = "images_npy";
    else if (*scene->poses.text && (n = count_photos(folder, "images", -1)) > 0)
        scene->photos = "images";
    if (n <= stray) return false;
    scene->stray = stray;
    find_points(scene, folder);
    return true;
}

int fs_scene_folder_take(Settings *set, const char *folder, const Log *log, FsError *err)
{
    SceneFolder scene;
    if (!fs_scene_folder_find(&scene, folder)) return 0;
    bool given = *set->poses;
    if (!given && *scene.poses.text) MUST(fs_settings_set(set, "poses", scene.poses.text, err));
    fs_log_info(log, "%s: a scene folder: photos from %s, poses %s%s", folder, scene.photos,
                given               ? "as --poses says"
                : *scene.poses.text ? "from "
                                    : "by COLMAP",
                given ? "" : scene.poses.text);
    if (scene.stray)
        fs_log_info(log, "%s: %d picture%s beside %s/ %s not taken", folder, scene.stray, scene.stray > 1 ? "s" : "",
                    scene.photos, scene.stray > 1 ? "are" : "is");
    if (*scene.points.text && !*set->points)
        fs_log_info(log, "%s: a dense cloud is there too; --points %s starts from it", folder, scene.points.text);
    return 0;
}

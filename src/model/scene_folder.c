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

// N<name> in the folder, or what lies `below` it, of the largest N.
static void find_numbered(const char *folder, const FileList *list, const char *name, const char *below,
                          FilePath *found)
{
    int most = 0;
    for (int i = 0; i < list->n; i++) {
        char *end;
        long n = strtol(list->name[i], &end, 10);
        FilePath path = fs_file_at("%s/%s%s", folder, list->name[i], below);
        if (strcmp(end, name) != 0 || n <= most || n > 100000 || !fs_file_exists(path.text)) continue;
        most = (int)n;
        *found = path;
    }
}

// 30_views/dense/fused.ply of all photos; 15_noflash_fused.ply and 15_flash_fused.ply.
static void find_points(SceneFolder *scene, const char *folder)
{
    FileList list = {0};
    if (fs_file_list(folder, &list, NULL) < 0) return;
    find_numbered(folder, &list, "_views", "/dense/fused.ply", &scene->points);
    find_numbered(folder, &list, "_noflash_fused.ply", "", &scene->fused[0]);
    find_numbered(folder, &list, "_flash_fused.ply", "", &scene->fused[1]);
    if (!*scene->fused[0].text || !*scene->fused[1].text) scene->fused[0].text[0] = scene->fused[1].text[0] = 0;
    fs_file_list_free(&list);
}

bool fs_scene_folder_find(SceneFolder *scene, const char *folder)
{
    *scene = (SceneFolder){0};
    bool ours = fs_file_exists(fs_file_at("%s/" FS_OWNED_DIR, folder).text);
    int stray = count_photos(folder, "", -1), n;
    if (ours) return false;
    find_poses(scene, folder);
    if ((n = count_photos(folder, "images_npy", PHOTO_NPY)) > 0)
        scene->photos = "images_npy";
    else if (stray <= MOST_STRAY && *scene->poses.text && (n = count_photos(folder, "images", -1)) > 0)
        scene->photos = "images";
    if (n <= stray) return false;
    scene->stray = stray;
    find_points(scene, folder);
    return true;
}

// The published program's cue goes by the dense clouds of either lighting.
static int take_lightings(Settings *set, const SceneFolder *scene, const char *folder, const Log *log, FsError *err)
{
    if (!*scene->fused[0].text || strcmp(set->flash_cue, "depth") != 0 || *set->flash_points || *set->noflash_points)
        return 0;
    MUST(fs_settings_set(set, "noflash-points", scene->fused[0].text, err));
    MUST(fs_settings_set(set, "flash-points", scene->fused[1].text, err));
    fs_log_info(log, "%s: the two scenes are parted by its clouds of either lighting: %s and %s", folder,
                fs_file_name(scene->fused[1].text), fs_file_name(scene->fused[0].text));
    return 0;
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
    return take_lightings(set, &scene, folder, log, err);
}

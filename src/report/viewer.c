#include "report/viewer.h"

#include <stdlib.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/json_file.h"
#include "model/rendered_from.h"
#include "model/scene.h"
#include "report/pack.h"
#include "report/text7.h"

#define VERSION 1
#define PHOTO_EDGE 640
#define PHOTO_QUALITY 80

// ---- what stands in words ----

static json_t *range(const PackRange *r)
{
    return json_pack("[f, f, i]", r->low, r->high, r->bits);
}

static json_t *describe_cloud(const Pack *pack, Layer layer)
{
    return json_pack("{s:s, s:i, s:i, s:i, s:i, s:o, s:f, s:o, s:f, s:i, s:o, s:o, s:o, s:o, s:o}", "layer",
                     fs_layers[layer].name, "n", pack->n, "colors", pack->colors, "gains", pack->gains, "covers",
                     pack->covers, "centre", fs_json_file_doubles(pack->centre, 3), "reach", pack->reach, "low",
                     fs_json_file_doubles(pack->low, 3), "step", pack->step, "bits", pack->bits, "size",
                     range(&pack->size), "turn", range(&pack->turn), "opacity", range(&pack->opacity), "color",
                     range(&pack->color), "gain", range(&pack->gain));
}

static json_t *describe_view(const View *view, int photo)
{
    const Camera *c = &view->camera;
    return json_pack("{s:s, s:b, s:i, s:i, s:i, s:f, s:f, s:f, s:f, s:o}", "name", view->name, "flash", view->flash,
                     "photo", photo, "width", c->width, "height", c->height, "fx", c->fx, "fy", c->fy, "cx", c->cx,
                     "cy", c->cy, "w2c", fs_json_file_doubles(c->w2c, 12));
}

// photo: the number of the view's picture, 0 where there is none.
static json_t *describe_views(const Dataset *dataset, const Viewer *viewer)
{
    json_t *list = json_array();
    for (int v = 0; v < dataset->n; v++) {
        int photo = 0;
        for (int i = 0; i < viewer->photos; i++)
            if (viewer->photo[i] == v) photo = i + 1;
        json_array_append_new(list, describe_view(&dataset->view[v], photo));
    }
    return list;
}

static json_t *describe_scene(const Scene *scene, double metres_per_unit, const PreviewLight *light)
{
    static const double none[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double *matrix = light->has_matrix ? light->srgb_from_camera : none;
    return json_pack("{s:i, s:b, s:b, s:b, s:o, s:f, s:f, s:f, s:f, s:o, s:b, s:f, s:f, s:o}", "version", VERSION,
                     "lit", fs_scene_lit(scene), "even", scene->separation == SEPARATION_LINEAR, "pane",
                     scene->pane_beta, "normal", fs_json_file_doubles(scene->pane.normal, 3), "f0", scene->pane.f0,
                     "dimming", scene->pane.dimming, "flash_distance", scene->flash_distance, "flash_return",
                     scene->flash_return, "gain_color", fs_json_file_doubles(scene->gain_color, 3), "shared",
                     scene->shared_geometry, "metres_per_unit", metres_per_unit, "exposure", (double)light->exposure,
                     "matrix", fs_json_file_doubles(matrix, 9));
}

// Metres in a unit, as the renders have it: what was given now or then, or what the scene says; 0: not known.
static double scale_of(const FsProject *project, const Scene *scene)
{
    if (project->set.metres_per_unit > 0) return project->set.metres_per_unit;
    FilePath renders = fs_file_at("%s/renders", project->out);
    bool known = fs_rendered_from_ask(project, renders.text) == RENDERED_FROM_THESE;
    double given = known ? fs_rendered_from_scale(renders.text) : 0;
    return given > 0 ? given : scene->metres_per_unit;
}

// ---- pictures of the photos ----

static int write_photo(const FsProject *project, const View *view, int number, const PreviewLight *light, FsError *err)
{
    Image photo = {0}, picture = {0};
    FilePath path = fs_file_at("%s/report/photo_%d.jpg", project->out, number);
    int rc;
    TRY(fs_dataset_load_view(project->out, view, &photo, NULL, err));
    TRY(fs_preview_picture(&photo, PHOTO_EDGE, light, &picture, err));
    TRY(fs_jpeg_write(path.text, &picture, PHOTO_QUALITY, NULL, err));
fail:
    fs_image_free(&photo);
    fs_image_free(&picture);
    return rc;
}

// One that cannot be read is left out.
static int write_photos(const FsProject *project, const Dataset *dataset, const PreviewLight *light, Viewer *viewer,
                        FsError *err)
{
    int chosen[FS_VIEWER_PHOTOS], n = fs_preview_choose(dataset, FS_VIEWER_PHOTOS, chosen);
    for (int i = 0; i < n; i++) {
        FsError why = {0};
        int rc = write_photo(project, &dataset->view[chosen[i]], viewer->photos + 1, light, &why);
        if (rc == FS_ERR_MEMORY) return fs_error_memory(err);
        if (rc == FS_ERR_IO) return fs_error_set(err, rc, "%s", why.message);
        if (rc < 0) fs_log_warn(&project->log, "report: %s; the viewer is without that photo", why.message);
        if (rc == 0) viewer->photo[viewer->photos++] = chosen[i];
    }
    return 0;
}

// ---- the file ----

// A cloud that the image equation uses.
static bool is_shown(const Scene *scene, int layer)
{
    bool beta = layer == LAYER_BETA && scene->pane_beta, T_F = layer == LAYER_T_F && scene->shared_geometry;
    return scene->cloud[layer].n > 0 && !beta && !T_F;
}

static int put_scene(FILE *f, json_t *root, const TextChunk *chunk, int n, FsError *err)
{
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    if (!text) return fs_error_memory(err);
    fprintf(f, "// A scene of flashsplat: docs/viewer.md.\nflashsplat.open(%s,\n", text);
    free(text);
    MUST(fs_text7_write(f, chunk, n, err));
    fputs(");\n", f);
    return 0;
}

static int write_scene(const char *path, const Scene *scene, json_t *root, const double centre[3], Viewer *viewer,
                       FsError *err)
{
    AtomicFile file = {0};
    Pack pack[LAYERS] = {0};
    TextChunk chunk[LAYERS];
    json_t *clouds = json_array();
    int rc, n = 0;
    for (int l = 0; l < LAYERS; l++) {
        if (!is_shown(scene, l)) continue;
        Pack *p = &pack[n];
        TRY(fs_pack_cloud(&scene->cloud[l], centre, p, err));
        chunk[n++] = (TextChunk){p->byte, (size_t)p->planes * (size_t)p->n};
        json_array_append_new(clouds, describe_cloud(p, (Layer)l));
        viewer->splats += p->n;
    }
    json_object_set(root, "clouds", clouds);
    TRY(fs_file_begin(&file, path, err));
    TRY(put_scene(file.f, root, chunk, n, err));
    TRY(fs_file_commit(&file, err));
    struct stat st;
    if (stat(path, &st) == 0) viewer->bytes = (long)st.st_size;
fail:
    json_decref(clouds);
    fs_file_abort(&file);
    for (int i = 0; i < LAYERS; i++) fs_pack_free(&pack[i]);
    return rc;
}

int fs_viewer_write(const FsProject *project, const Dataset *dataset, const PreviewLight *light, Viewer *viewer,
                    FsError *err)
{
    FilePath clouds = fs_file_at("%s/clouds", project->out), path = fs_file_at("%s/report/scene.js", project->out);
    Scene scene = {0};
    json_t *root = NULL;
    double centre[3];
    int rc = 0;
    *viewer = (Viewer){0};
    if (!fs_file_exists(fs_file_at("%s/model.json", clouds.text).text)) return 0;
    TRY(fs_scene_read(&scene, clouds.text, err));
    if (fs_radiance_is(&scene.field)) goto fail; // it shows Gaussians
    TRY(write_photos(project, dataset, light, viewer, err));
    double unit = scale_of(project, &scene);
    fs_dataset_extent(dataset, centre);
    root = describe_scene(&scene, unit, light);
    json_object_set_new(root, "extent", json_real(scene.extent));
    json_object_set_new(root, "views", describe_views(dataset, viewer));
    TRY(write_scene(path.text, &scene, root, centre, viewer, err));
    viewer->there = true;
    fs_log_info(&project->log, "report: %d Gaussians to look around in, %.1f MB (%.1f bytes each)", viewer->splats,
                (double)viewer->bytes / 1e6, (double)viewer->bytes / (viewer->splats ? viewer->splats : 1));
fail:
    json_decref(root);
    fs_scene_free(&scene);
    return rc;
}

// Export: one development for the whole scene, then a file per layer and format.
#include "export/export.h"

#include <stdlib.h>

#include "base/file.h"
#include "base/json_file.h"
#include "export/colors.h"
#include "export/formats.h"
#include "image/tone.h"
#include "model/dataset.h"
#include "model/preview.h"

// What the capture's colours mean, where ingest knew it from the RAW files.
static void read_matrix(const FsProject *project, Development *development)
{
    json_t *root;
    fs_json_file_read(fs_file_at("%s/ingest.json", project->out).text, 64 << 20, &root, NULL);
    double *m = development->srgb_from_camera;
    development->has_matrix = json_unpack(root, "{s:[FFFFFFFFF!]}", "srgb_from_camera", m, m + 1, m + 2, m + 3, m + 4,
                                          m + 5, m + 6, m + 7, m + 8) == 0;
    json_decref(root);
}

// Without photos: from the Gaussians' own colours, the brightest lighting there is.
static int cloud_exposure(const Scene *scene, Development *development, FsError *err)
{
    Layer layer = fs_colors_cloud(scene, LAYER_T_F)   ? LAYER_T_F
                  : fs_colors_cloud(scene, LAYER_T_N) ? LAYER_T_N
                                                      : LAYER_R;
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    development->exposure = 1;
    if (!cloud) return 0;
    Image colors = {.width = cloud->n, .height = 1, .channels = 3};
    colors.px = malloc(sizeof(float) * 3 * (size_t)cloud->n);
    if (!colors.px) return fs_error_memory(err);
    fs_colors_linear(scene, layer, development, colors.px);
    development->exposure = fs_tone_pleasant_exposure(&colors, 1);
    free(colors.px);
    return 0;
}

static int develop(const FsProject *project, const Scene *scene, Development *development, FsError *err)
{
    *development = (Development){0};
    Dataset views = {0};
    read_matrix(project, development);
    FilePath path = fs_file_at("%s/views.json", project->out);
    if (fs_file_exists(path.text) && fs_dataset_read(&views, path.text, NULL) == 0) {
        fs_dataset_extent(&views, development->eye);
        development->has_eye = views.n > 0;
        fs_preview_exposure(project->out, &views, &development->exposure, NULL); // 0 when the photos are gone
    }
    fs_dataset_free(&views);
    const char *source = "the photos";
    if (!(development->exposure > 0)) {
        source = "the clouds";
        MUST(cloud_exposure(scene, development, err));
    }
    fs_log_info(&project->log, "export: colours are camera RGB times %.3g (exposure from %s)%s, a soft shoulder, sRGB",
                (double)development->exposure, source,
                development->has_matrix ? ", the camera's colour matrix" : ", taken for sRGB's primaries");
    return 0;
}

// One file; splats: the layer's, as they come.
static int export_file(const FsProject *project, const Splats *splats, const Format *format, const char *name,
                       FsError *err)
{
    if (splats->n == 0) return 0; // what readers do with none differs
    if (splats->n > format->most) {
        fs_log_warn(&project->log, "export: %s: no %s: %d Gaussians, and its readers take %lld", name, format->name,
                    splats->n, format->most);
        return 0;
    }
    FilePath path = fs_file_at("%s/export/%s.%s", project->out, name, format->ending);
    MUST(format->write(splats, path.text, err));
    fs_log_info(&project->log, "export: %s: %d Gaussians: %s", name, splats->n, path.text);
    return 0;
}

// The files of a layer, out of its cloud and the colours that viewers show it in.
static int export_cloud(const FsProject *project, const Cloud *cloud, const float *srgb, const char *name,
                        const bool wanted[FORMATS], FsError *err)
{
    int rc = 0;
    bool told = false;
    Splats splats = {0};
    for (int f = 0; f < FORMATS; f++) {
        if (!wanted[f]) continue;
        fs_splats_free(&splats);
        TRY(fs_splats_make(cloud, srgb, &splats, err));
        if (splats.n < cloud->n && !told)
            fs_log_warn(&project->log, "export: %s: %d of %d Gaussians are left out: they are no numbers", name,
                        cloud->n - splats.n, cloud->n);
        told = true;
        if (fs_formats[f].y_up) fs_splats_turn(&splats);
        TRY(fs_splats_sort(&splats, fs_formats[f].order, err));
        TRY(export_file(project, &splats, &fs_formats[f], name, err));
    }
fail:
    fs_splats_free(&splats);
    return rc;
}

static int export_layer(const FsProject *project, const Scene *scene, Layer layer, const Development *development,
                        const bool wanted[FORMATS], FsError *err)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    if (!cloud) return 0; // nothing to show
    float *srgb = malloc(sizeof(float) * 3 * (size_t)cloud->n);
    if (!srgb) return fs_error_memory(err);
    fs_colors_display(scene, layer, development, srgb);
    int rc = export_cloud(project, cloud, srgb, fs_layers[layer].name, wanted, err);
    free(srgb);
    return rc;
}

int fs_export_run(FsProject *project, FsError *err)
{
    bool wanted[FORMATS];
    MUST(fs_formats_parse(project->set.formats, wanted, err));
    if (fs_project_done(project, FS_STAGE_EXPORT)) return 0;
    Scene scene = {0};
    Development development;
    int rc;
    FilePath model = fs_file_at("%s/clouds/model.json", project->out);
    if (!fs_file_exists(model.text)) return fs_error_input(err, "%s: missing: train the scene first", model.text);
    TRY(fs_project_begin(project, FS_STAGE_EXPORT, NULL, 0, err));
    TRY(fs_scene_read(&scene, fs_file_at("%s/clouds", project->out).text, err));
    TRY(fs_file_mkdirs(fs_file_at("%s/export", project->out).text, err));
    TRY(develop(project, &scene, &development, err));
    for (int l = 0; l < LAYERS; l++) {
        if (fs_log_cancelled(&project->log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "export: stopped"));
        fs_log_progress(&project->log, "export", l, LAYERS, fs_layers[l].name);
        TRY(export_layer(project, &scene, (Layer)l, &development, wanted, err));
    }
    fs_log_progress(&project->log, "export", LAYERS, LAYERS, "done");
    TRY(fs_project_mark_done(project, FS_STAGE_EXPORT, err));
fail:
    fs_scene_free(&scene);
    return rc;
}

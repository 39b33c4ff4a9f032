// Export: one development for the whole scene, then a file per layer and format.
#include "export/export.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "export/clean.h"
#include "export/clean_trial.h"
#include "export/colors.h"
#include "export/formats.h"
#include "export/pane_place.h"
#include "export/surface.h"
#include "export/trainer_dataset.h"
#include "image/tone.h"
#include "model/dataset.h"
#include "model/preview.h"

// Everything that one run of the stage holds.
typedef struct Export {
    const FsProject *project;
    Scene scene;
    Dataset photos; // as posed; none where they are not known
    Development development;
    PanePlace pane;
    bool has_pane, wanted[FORMATS], clean[CLEAN_FORMATS];
    Originals originals; // where photos are to be cleaned
} Export;

// From the Gaussians' own colours.
static int cloud_exposure(const Scene *scene, Layer layer, Development *development, FsError *err)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    development->light.exposure = 1;
    if (!cloud) return 0;
    Image colors = {.width = cloud->n, .height = 1, .channels = 3};
    colors.px = malloc(sizeof(float) * 3 * (size_t)cloud->n);
    if (!colors.px) return fs_error_memory(err);
    fs_colors_linear(scene, layer, development, colors.px);
    development->light.exposure = fs_tone_pleasant_exposure(&colors, 1);
    free(colors.px);
    return 0;
}

static int develop(Export *x, FsError *err)
{
    Development *development = &x->development;
    fs_preview_matrix(x->project->out, &development->light);
    if (x->photos.n) {
        fs_dataset_extent(&x->photos, development->eye);
        development->has_eye = true;
        fs_preview_light(x->project->out, &x->photos, &development->light, NULL); // exposure 0 when the photos are gone
    }
    const char *source = "the photos";
    if (!(development->light.exposure > 0)) {
        source = "the clouds";
        Layer brightest = fs_colors_cloud(&x->scene, LAYER_T_F)   ? LAYER_T_F
                          : fs_colors_cloud(&x->scene, LAYER_T_N) ? LAYER_T_N
                                                                  : LAYER_R;
        MUST(cloud_exposure(&x->scene, brightest, development, err));
    }
    fs_log_info(&x->project->log,
                "export: colours are camera RGB times %.3g (exposure from %s)%s, a soft shoulder, "
                "sRGB",
                (double)development->light.exposure, source,
                development->light.has_matrix ? ", the camera's colour matrix" : ", taken for sRGB's primaries");
    return 0;
}

// kind: what the scene is, or will be.
static int check_unmirror(const Scene *kind, FsError *err)
{
    if (kind->separation == SEPARATION_NONE)
        return fs_error_set(err, FS_ERR_USAGE,
                            "--unmirror does not go with --separation none: nothing is mirrored there");
    if (kind->pane_beta) return 0;
    return fs_error_set(err, FS_ERR_USAGE,
                        "--unmirror goes with --beta pane: with --beta cloud no pane is learned to mirror back at");
}

static int open_export(Export *x, FsError *err)
{
    const Settings *set = &x->project->set;
    const char *out = x->project->out;
    FilePath views = fs_file_at("%s/views.json", out);
    MUST(fs_scene_read(&x->scene, fs_file_at("%s/clouds", out).text, err));
    if (set->unmirror && x->scene.separation == SEPARATION_NONE) return check_unmirror(&x->scene, err);
    if (fs_file_exists(views.text)) MUST(fs_dataset_read(&x->photos, views.text, err));
    x->has_pane = x->scene.pane_beta && x->scene.cloud[LAYER_R].n > 0;
    if (x->has_pane || set->unmirror)
        MUST(fs_pane_place_find(&x->scene, &x->photos, set->pane_distance, &x->pane, err));
    return develop(x, err);
}

// ---- a layer ----

typedef struct Piece {
    const char *name; // of the files
    Layer layer;
    Development development;
    bool with_pane, mirrored_back;
} Piece;

// Sizes that a format cannot tell are drawn as large as the last it can: of a thin Gaussian's thickness nobody sees
// that.
static void warn_of_sizes(const Export *x, const Splats *splats, const Format *format, const char *name)
{
    int beyond = 0;
    for (int i = 0; i < splats->n && format->size[1] > format->size[0]; i++) {
        const float *s = splats->scale + 3 * i, most = fmaxf(fmaxf(s[0], s[1]), s[2]);
        beyond += most < format->size[0] || most > format->size[1];
    }
    if (beyond > splats->n / 100)
        fs_log_warn(&x->project->log,
                    "export: %s: %s: %.0f %% of the Gaussians are of sizes that the format does not hold (%.2g to %.3g "
                    "units): give poses in another unit, or use PLY",
                    name, format->name, 100.0 * beyond / splats->n, exp((double)format->size[0]),
                    exp((double)format->size[1]));
}

// Points of what is at least half opaque: a short training may have none.
static bool has_points(const Splats *splats)
{
    for (int i = 0; i < splats->n; i++)
        if (splats->opacity[i] >= 0) return true;
    return false;
}

static int export_file(const Export *x, const Splats *splats, const Format *format, const char *name, FsError *err)
{
    if (splats->n == 0) return 0; // what readers do with none differs
    if (splats->n > format->most) {
        fs_log_warn(&x->project->log, "export: %s: no %s: %d Gaussians, and its readers take %lld", name, format->name,
                    splats->n, format->most);
        return 0;
    }
    if (format->write == fs_point_cloud_write && !has_points(splats)) {
        fs_log_warn(&x->project->log, "export: %s: no points: none of its Gaussians is half opaque", name);
        return 0;
    }
    warn_of_sizes(x, splats, format, name);
    FilePath path = fs_file_at("%s/export/%s.%s", x->project->out, name, format->ending);
    MUST(format->write(splats, path.text, err));
    fs_log_info(&x->project->log, "export: %s: %d Gaussians: %s", name, splats->n, path.text);
    return 0;
}

// The Gaussians of a layer as a format wants them.
static int make_splats(const Export *x, const Piece *piece, const Format *format, const float *srgb, Splats *splats,
                       FsError *err)
{
    fs_splats_free(splats);
    MUST(fs_splats_make(fs_colors_cloud(&x->scene, piece->layer), srgb, splats, err));
    if (piece->mirrored_back) fs_splats_mirror(splats, x->pane.normal, x->pane.distance);
    splats->has_pane = piece->with_pane && x->pane.has_corners;
    if (splats->has_pane) memcpy(splats->pane, x->pane.corner, sizeof splats->pane);
    if (format->y_up) fs_splats_turn(splats);
    return fs_splats_sort(splats, format->order, err);
}

// Some few that went astray are nothing to worry about.
static void say_left_out(const Export *x, const Piece *piece, int left_out, int n)
{
    static const char text[] =
        "export: %s: %d of %d Gaussians are left out: they are no numbers, or beyond all measure";
    if (left_out > n / 1000)
        fs_log_warn(&x->project->log, text, piece->name, left_out, n);
    else if (left_out)
        fs_log_info(&x->project->log, text, piece->name, left_out, n);
}

static int export_piece(const Export *x, const Piece *piece, FsError *err)
{
    const Cloud *cloud = fs_colors_cloud(&x->scene, piece->layer);
    if (!cloud) return 0; // nothing to show
    int rc = 0;
    bool told = false;
    Splats splats = {0};
    float *srgb = malloc(sizeof(float) * 3 * (size_t)cloud->n);
    if (!srgb) return fs_error_memory(err);
    fs_colors_display(&x->scene, piece->layer, &piece->development, srgb);
    for (int f = 0; f < FORMATS; f++) {
        if (!x->wanted[f] || !fs_formats[f].write) continue;
        TRY(make_splats(x, piece, &fs_formats[f], srgb, &splats, err));
        if (!told) say_left_out(x, piece, cloud->n - splats.n, cloud->n);
        told = true;
        TRY(export_file(x, &splats, &fs_formats[f], piece->name, err));
    }
fail:
    fs_splats_free(&splats);
    free(srgb);
    return rc;
}

static double pane_distance(const Export *x)
{
    const double *n = x->pane.normal, *eye = x->development.eye; // the origin where no photos are known
    return x->pane.distance - n[0] * eye[0] - n[1] * eye[1] - n[2] * eye[2];
}

// The mirrored room itself, reflected back across the pane, with an exposure of its own.
static int export_room(const Export *x, FsError *err)
{
    Piece room = {"room", LAYER_R, x->development, true, true};
    room.development.room = true;
    MUST(cloud_exposure(&x->scene, LAYER_R, &room.development, err));
    fs_log_info(&x->project->log,
                "export: room: reflected at a pane %.3g units from the middle of the photos%s, colours times %.3g",
                pane_distance(x), x->project->set.pane_distance > 0 ? "" : " (where what is behind it begins)",
                (double)room.development.light.exposure);
    return export_piece(x, &room, err);
}

int fs_export_check(const Settings *set, FsError *err)
{
    Scene kind = {0};
    fs_scene_set_kind(&kind, set);
    return set->unmirror ? check_unmirror(&kind, err) : 0;
}

int fs_export_estimate(const FsProject *project, const char *folder, RunCost *cost, FsError *err)
{
    bool clean[CLEAN_FORMATS];
    FilePath found;
    *cost = (RunCost){0};
    fs_clean_wanted(project->set.clean, clean);
    if (!*project->set.clean) return 0;
    if (!folder) MUST(fs_originals_folder(project, &found, err));
    return fs_clean_trial_run(project, folder ? folder : found.text, clean, cost, err);
}

// Before anything of an earlier export goes. Where there is none, each photo is told of as it is cleaned.
static int find_originals(Export *x, FsError *err)
{
    const CleanArgs args = {.project = x->project, .views = &x->photos, .originals = &x->originals};
    if (!*x->project->set.clean) return 0;
    if (!x->photos.n) MUST(fs_dataset_read(&x->photos, fs_file_at("%s/views.json", x->project->out).text, err));
    MUST(fs_originals_open(&x->originals, x->project, &x->photos, err));
    bool again = fs_file_exists(fs_file_at("%s/export/photos", x->project->out).text);
    return again ? fs_clean_check(&args, err) : 0;
}

int fs_export_run(FsProject *project, FsError *err)
{
    Export x = {.project = project};
    int rc;
    for (int f = 0; f < FORMATS; f++) x.wanted[f] = fs_settings_has_word(project->set.formats, fs_formats[f].name);
    fs_clean_wanted(project->set.clean, x.clean);
    if (fs_project_done(project, FS_STAGE_EXPORT)) return 0;
    TRY(open_export(&x, err));
    TRY(find_originals(&x, err));
    TRY(fs_project_begin(project, FS_STAGE_EXPORT, NULL, 0, err));
    TRY(fs_file_mkdirs(fs_file_at("%s/export", project->out).text, err));
    for (int l = 0; l < LAYERS; l++) {
        if (fs_log_cancelled(&project->log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "export: stopped"));
        fs_log_progress(&project->log, "export", l, LAYERS, fs_layers[l].name);
        const Piece piece = {fs_layers[l].name, (Layer)l, x.development, l == LAYER_R && x.has_pane, false};
        TRY(export_piece(&x, &piece, err));
    }
    if (project->set.unmirror) TRY(export_room(&x, err));
    if (fs_radiance_is(&x.scene.field))
        fs_log_info(&project->log, "export: radiance fields have no Gaussians to write");
    const ExportArgs args = {project, &x.scene, &x.photos, &x.development};
    for (int f = 0; f < FORMATS; f++)
        if (x.wanted[f] && !fs_formats[f].write) TRY(fs_surface_run(&args, fs_formats[f].ending, err));
    if (project->set.dataset) TRY(fs_trainer_dataset_run(&args, err));
    const CleanArgs clean = {project, &x.scene, &x.photos, &x.originals, &x.development, x.clean};
    if (*project->set.clean) TRY(fs_clean_run(&clean, err));
    fs_log_progress(&project->log, "export", LAYERS, LAYERS, "done");
    TRY(fs_project_mark_done(project, FS_STAGE_EXPORT, err));
fail:
    fs_scene_free(&x.scene);
    fs_dataset_free(&x.photos);
    fs_originals_free(&x.originals);
    return rc;
}

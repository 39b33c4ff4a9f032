// Checkpoints: everything training needs to go on as if it had never stopped. Written beside the old one, then swapped,
// so that there is a whole one at any moment.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "train/trainer.h"

static int each_moment(TrainState *state, const Scene *scene, const char *dir, bool write, FsError *err)
{
    int rc = 0;
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *cloud = &scene->cloud[l];
        if (!cloud->n) continue;
        Cloud *moments[2] = {&state->cloud[l].m, &state->cloud[l].v};
        for (int k = 0; k < 2; k++) {
            FilePath path = fs_file_at("%s/%s_%s.ply", dir, fs_layers[l].name, k ? "v" : "m");
            TRY(write ? fs_cloud_ply_write(moments[k], path.text, err) : fs_cloud_ply_read(moments[k], path.text, err));
            if (moments[k]->n != cloud->n || memcmp(moments[k]->width, cloud->width, sizeof cloud->width) != 0)
                TRY(fs_error_set(err, FS_ERR_INPUT, "%s: not of its cloud of %d Gaussians", path.text, cloud->n));
        }
    }
fail:
    return rc;
}

// One array as it lies in memory. Reading: *array is replaced; a file that is not there leaves it NULL.
static int each_array(const char *dir, const char *name, void **array, size_t size, bool write, FsError *err)
{
    FilePath path = fs_file_at("%s/%s.bin", dir, name);
    char *data = NULL;
    size_t found = size;
    int rc = 0;
    if (write) return *array ? fs_file_write(path.text, *array, size, err) : 0;
    free(*array);
    *array = NULL;
    if (fs_file_exists(path.text)) TRY(fs_file_read(path.text, size, &data, &found, err));
    if (found != size) TRY(fs_error_set(err, FS_ERR_INPUT, "%s: %zu bytes, expected %zu", path.text, found, size));
    *array = data;
    return 0;
fail:
    free(data);
    return rc;
}

// Both moments of what is one array; they must be there.
static int each_moments(const char *dir, const char *of, float **moments[2], size_t floats, bool write, FsError *err)
{
    for (int k = 0; k < 2; k++) {
        FilePath name = fs_file_at("%s_%s", of, k ? "v" : "m");
        MUST(each_array(dir, name.text, (void **)moments[k], floats * sizeof(float), write, err));
        if (!*moments[k]) return fs_error_set(err, FS_ERR_INPUT, "%s/%s.bin: not there", dir, name.text);
    }
    return 0;
}

static int each_field_moment(TrainState *state, const Scene *scene, const char *dir, bool write, FsError *err)
{
    float **moments[2] = {&state->field_m, &state->field_v};
    return fs_radiance_is(&scene->field) ? each_moments(dir, "field", moments, scene->field.n, write, err) : 0;
}

static int each_veil_moment(TrainState *state, const Scene *scene, const char *dir, bool write, FsError *err)
{
    float **moments[2] = {&state->veil_m, &state->veil_v};
    size_t floats = fs_image_values(&scene->veil.light);
    return fs_pane_veil_is(&scene->veil) ? each_moments(dir, "veil", moments, floats, write, err) : 0;
}

// What lasts from one densification to the next: whose gains are compared, and how far Gaussians were pulled on screen.
static int each_statistic(Trainer *trainer, const char *dir, bool write, FsError *err)
{
    int rc = 0;
    for (int l = 0; l < LAYERS && rc == 0; l++) {
        CloudState *state = &trainer->state.cloud[l];
        size_t n = (size_t)trainer->scene.cloud[l].n;
        char name[40];
        snprintf(name, sizeof name, "%s_screen", fs_layers[l].name);
        if (n) rc = each_array(dir, name, (void **)&state->screen, sizeof(float) * 2 * n, write, err);
    }
    int n = trainer->scene.cloud[LAYER_T_N].n;
    size_t size = sizeof(int) * (size_t)n * ENGINE_NEIGHBOURS;
    if (rc == 0) rc = each_array(dir, "T_N_neighbours", (void **)&trainer->neighbour, size, write, err);
    for (int i = 0; rc == 0 && trainer->neighbour && i < n * ENGINE_NEIGHBOURS; i++)
        if (trainer->neighbour[i] < 0 || trainer->neighbour[i] >= n)
            rc = fs_error_set(err, FS_ERR_INPUT, "%s/T_N_neighbours.bin: not of this cloud", dir);
    return rc;
}

// What the photos' light was found to be, one after the other as they are trained on.
static int each_photo(Trainer *trainer, const char *dir, bool write, FsError *err)
{
    size_t size = sizeof *trainer->photo * (size_t)trainer->n_views;
    if (size == 0) return 0;
    MUST(each_array(dir, "photos", (void **)&trainer->photo, size, write, err));
    if (trainer->photo) return 0;
    return fs_error_set(err, FS_ERR_INPUT, "%s/photos.bin: not there", dir);
}

// Where the photographer is mirrored, as far as looked for.
static int each_occlusion(Trainer *trainer, const char *dir, bool write, FsError *err)
{
    size_t size = sizeof *trainer->occlusion * (size_t)trainer->n_views;
    MUST(each_array(dir, "occlusion", (void **)&trainer->occlusion, size, write, err));
    for (int v = 0; !write && trainer->occlusion && v < trainer->n_views; v++)
        for (int i = 0; i < OCCLUSION_CELLS; i++) {
            const OcclusionState *state = &trainer->occlusion[v];
            if (!(state->q[i] >= 0 && state->q[i] <= 1) || !isfinite(state->cost[i]))
                return fs_error_set(err, FS_ERR_INPUT, "%s/occlusion.bin: not shares of light", dir);
        }
    return 0;
}

// What the photos show that others do not, where it is looked for, and what of them is left out for it.
static int each_passer(Trainer *trainer, const char *dir, bool write, FsError *err)
{
    size_t cells = (size_t)OCCLUSION_CELLS * (size_t)trainer->n_views;
    MUST(each_array(dir, "residual", (void **)&trainer->residual, 3 * sizeof(float) * cells, write, err));
    return each_array(dir, "passers", (void **)&trainer->passers, cells, write, err);
}

static int write_state(const Trainer *trainer, const char *dir, FsError *err)
{
    const char *made_from = fs_project_fingerprint(trainer->project, FS_STAGE_TRAIN);
    json_t *root = json_pack("{s:i,s:f,s:s?,s:o,s:o,s:o}", "step", trainer->step, "seconds",
                             trainer->seconds + fs_clock_seconds() - trainer->begin, "made_from", made_from, "global_m",
                             fs_json_file_floats(trainer->state.m, ENGINE_NUMBERS), "global_v",
                             fs_json_file_floats(trainer->state.v, ENGINE_NUMBERS), "smoothed",
                             fs_json_file_floats(trainer->smoothed, LOSS_TERMS));
    return fs_json_file_write(fs_file_at("%s/state.json", dir).text, root, JSON_INDENT(1) | JSON_REAL_PRECISION(17),
                              err);
}

int fs_checkpoint_write(Trainer *trainer, FsError *err)
{
    const char *out = trainer->project->out;
    FilePath dir = fs_file_at("%s/checkpoint", out), fresh = fs_file_at("%s/checkpoint.new", out);
    FilePath old = fs_file_at("%s/checkpoint.old", out);
    int rc;
    TRY(fs_engine_scene_down(trainer->engine, (1u << LAYERS) - 1, &trainer->scene, err));
    TRY(fs_engine_state_down(trainer->engine, &trainer->state, err));
    if (trainer->halvings >= 0) {
        TRY(fs_engine_photos_down(trainer->engine, trainer->photo, err));
        TRY(fs_photographer_down(trainer, err));
    }
    fs_owned_remove(fresh.text);
    TRY(fs_file_mkdirs(fresh.text, err));
    TRY(fs_scene_write(&trainer->scene, fresh.text, err));
    TRY(each_moment(&trainer->state, &trainer->scene, fresh.text, true, err));
    TRY(each_field_moment(&trainer->state, &trainer->scene, fresh.text, true, err));
    TRY(each_veil_moment(&trainer->state, &trainer->scene, fresh.text, true, err));
    TRY(each_statistic(trainer, fresh.text, true, err));
    TRY(each_photo(trainer, fresh.text, true, err));
    TRY(each_occlusion(trainer, fresh.text, true, err));
    TRY(each_passer(trainer, fresh.text, true, err));
    TRY(write_state(trainer, fresh.text, err));
    fs_owned_remove(old.text);
    if (fs_file_exists(dir.text)) TRY(fs_file_rename(dir.text, old.text, err));
    TRY(fs_file_rename(fresh.text, dir.text, err));
    fs_owned_remove(old.text);
fail:
    if (rc < 0) fs_owned_remove(fresh.text);
    return rc;
}

static int read_numbers(const json_t *root, const char *key, float *x, int n)
{
    const json_t *list = json_object_get(root, key);
    if (json_array_size(list) != (size_t)n) return -1;
    for (int i = 0; i < n; i++) x[i] = (float)json_number_value(json_array_get(list, (size_t)i));
    return 0;
}

static int read_state(Trainer *trainer, const char *dir, FsError *err)
{
    FilePath path = fs_file_at("%s/state.json", dir);
    json_t *root;
    fs_json_file_read(path.text, 1 << 20, &root, NULL);
    int rc = 0, step = (int)json_integer_value(json_object_get(root, "step"));
    if (!root || step < 0 || read_numbers(root, "global_m", trainer->state.m, ENGINE_NUMBERS) ||
        read_numbers(root, "global_v", trainer->state.v, ENGINE_NUMBERS) ||
        read_numbers(root, "smoothed", trainer->smoothed, LOSS_TERMS))
        rc = fs_error_set(
            err, FS_ERR_INPUT,
            "%s: not a checkpoint's state; remove that folder, and run without --resume, which begins anew", path.text);
    if (rc == 0)
        rc = fs_project_check(trainer->project, FS_STAGE_TRAIN, json_string_value(json_object_get(root, "made_from")),
                              dir, err);
    trainer->step = step;
    trainer->seconds = json_number_value(json_object_get(root, "seconds"));
    json_decref(root);
    return rc;
}

static int read_arrays(Trainer *trainer, const char *dir, FsError *err)
{
    fs_scene_free(&trainer->scene);
    MUST(fs_scene_read(&trainer->scene, dir, err));
    MUST(each_moment(&trainer->state, &trainer->scene, dir, false, err));
    MUST(each_field_moment(&trainer->state, &trainer->scene, dir, false, err));
    MUST(each_veil_moment(&trainer->state, &trainer->scene, dir, false, err));
    MUST(each_statistic(trainer, dir, false, err));
    MUST(each_photo(trainer, dir, false, err));
    MUST(each_occlusion(trainer, dir, false, err));
    return each_passer(trainer, dir, false, err);
}

int fs_checkpoint_read(Trainer *trainer, FsError *err)
{
    static const char *const names[] = {"checkpoint", "checkpoint.old"}; // .old: the swap was cut short
    int rc = 0;
    for (int i = 0; i < 2 && rc == 0; i++) {
        FilePath dir = fs_file_at("%s/%s", trainer->project->out, names[i]);
        if (!fs_file_exists(fs_file_at("%s/state.json", dir.text).text)) continue;
        TRY(read_state(trainer, dir.text, err)); // first: of other settings, the rest has other sizes
        FsError why = {0};
        rc = read_arrays(trainer, dir.text, &why);
        if (rc < 0)
            fs_error_set(err, rc, "%s%s", why.message,
                         rc == FS_ERR_INPUT ? "; remove that folder, and run without --resume, which begins anew" : "");
        else
            rc = 1;
    }
fail:
    return rc;
}

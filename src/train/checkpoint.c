// Checkpoints: everything training needs to go on as if it had never stopped. Written beside the old one, then swapped,
// so that there is a whole one at any moment.
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "base/owned.h"
#include "train/trainer.h"

static int each_moment(TrainState *state, const Scene *scene, const char *dir, bool write, FsError *err)
{
    int rc = 0;
    for (int l = 0; l < LAYERS && rc == 0; l++) {
        const Cloud *cloud = &scene->cloud[l];
        if (!cloud->n) continue;
        Cloud *moments[2] = {&state->cloud[l].m, &state->cloud[l].v};
        for (int k = 0; k < 2 && rc == 0; k++) {
            char *path = fs_file_path("%s/%s_%s.ply", dir, fs_layers[l].name, k ? "v" : "m");
            if (!path) return fs_error_memory(err);
            if (write)
                rc = fs_cloud_ply_write(moments[k], path, err);
            else
                rc = fs_cloud_ply_read(moments[k], path, err);
            if (rc == 0 &&
                (moments[k]->n != cloud->n || memcmp(moments[k]->width, cloud->width, sizeof cloud->width) != 0))
                rc = fs_error_set(err, FS_ERR_INPUT, "%s: not of its cloud of %d Gaussians; remove the checkpoint",
                                  path, cloud->n);
            free(path);
        }
    }
    return rc;
}

// One array as it lies in memory. Reading: *array is replaced; a file that is not there leaves it NULL.
static int each_array(const char *dir, const char *name, void **array, size_t size, bool write, FsError *err)
{
    char *path = fs_file_path("%s/%s.bin", dir, name), *data = NULL;
    size_t found = 0;
    int rc = path ? 0 : fs_error_memory(err);
    if (rc == 0 && write) {
        rc = *array ? fs_file_write(path, *array, size, err) : 0;
    } else if (rc == 0) {
        free(*array);
        *array = NULL;
        if (fs_file_exists(path)) rc = fs_file_read(path, size, &data, &found, err);
        if (rc == 0 && data && found != size) {
            free(data);
            rc = fs_error_set(err, FS_ERR_INPUT, "%s: %zu bytes, expected %zu; remove the checkpoint", path, found,
                              size);
        } else if (rc == 0) {
            *array = data;
        }
    }
    free(path);
    return rc;
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
            rc =
                fs_error_set(err, FS_ERR_INPUT, "%s/T_N_neighbours.bin: not of this cloud; remove the checkpoint", dir);
    return rc;
}

static json_t *numbers(const float *x, int n)
{
    json_t *list = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(list, json_real(x[i]));
    return list;
}

static int write_state(const Trainer *trainer, const char *dir, FsError *err)
{
    const char *made_from = fs_project_fingerprint(trainer->project, FS_STAGE_TRAIN);
    json_t *root =
        json_pack("{s:i,s:s?,s:o,s:o}", "step", trainer->step, "made_from", made_from, "global_m",
                  numbers(trainer->state.m, ENGINE_NUMBERS), "global_v", numbers(trainer->state.v, ENGINE_NUMBERS));
    char *text = root ? json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    char *path = fs_file_path("%s/state.json", dir);
    int rc = text && path ? fs_file_write(path, text, strlen(text), err) : fs_error_memory(err);
    json_decref(root);
    free(text);
    free(path);
    return rc;
}

int fs_checkpoint_write(Trainer *trainer, FsError *err)
{
    const char *out = trainer->project->out;
    char *dir = fs_file_path("%s/checkpoint", out), *fresh = fs_file_path("%s/checkpoint.new", out),
         *old = fs_file_path("%s/checkpoint.old", out);
    int rc = dir && fresh && old ? 0 : fs_error_memory(err);
    if (rc < 0) goto fail;
    TRY(fs_engine_scene_down(trainer->engine, (1u << LAYERS) - 1, &trainer->scene, err));
    TRY(fs_engine_state_down(trainer->engine, &trainer->state, err));
    fs_owned_remove(fresh);
    TRY(fs_file_mkdirs(fresh, err));
    TRY(fs_scene_write(&trainer->scene, fresh, err));
    TRY(each_moment(&trainer->state, &trainer->scene, fresh, true, err));
    TRY(each_statistic(trainer, fresh, true, err));
    TRY(write_state(trainer, fresh, err));
    fs_owned_remove(old);
    if (fs_file_exists(dir)) TRY(fs_file_rename(dir, old, err));
    TRY(fs_file_rename(fresh, dir, err));
    fs_owned_remove(old);
fail:
    if (rc < 0 && fresh) fs_owned_remove(fresh);
    free(dir);
    free(fresh);
    free(old);
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
    char *path = fs_file_path("%s/state.json", dir);
    if (!path) return fs_error_memory(err);
    json_error_t json;
    json_t *root = json_load_file(path, 0, &json);
    int rc = 0, step = (int)json_integer_value(json_object_get(root, "step"));
    if (!root || step < 0 || read_numbers(root, "global_m", trainer->state.m, ENGINE_NUMBERS) ||
        read_numbers(root, "global_v", trainer->state.v, ENGINE_NUMBERS))
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: not a checkpoint's state; remove the folder and train again", path);
    if (rc == 0)
        rc = fs_project_check(trainer->project, FS_STAGE_TRAIN, json_string_value(json_object_get(root, "made_from")),
                              dir, err);
    trainer->step = step;
    json_decref(root);
    free(path);
    return rc;
}

int fs_checkpoint_read(Trainer *trainer, FsError *err)
{
    static const char *const names[] = {"checkpoint", "checkpoint.old"}; // .old: the swap was cut short
    for (int i = 0; i < 2; i++) {
        char *dir = fs_file_path("%s/%s", trainer->project->out, names[i]);
        if (!dir) return fs_error_memory(err);
        char *state = fs_file_path("%s/state.json", dir);
        int rc = 0;
        if (state && fs_file_exists(state)) {
            fs_scene_free(&trainer->scene);
            TRY(fs_scene_read(&trainer->scene, dir, err));
            TRY(each_moment(&trainer->state, &trainer->scene, dir, false, err));
            TRY(each_statistic(trainer, dir, false, err));
            TRY(read_state(trainer, dir, err));
            rc = 1;
        }
    fail:
        free(state);
        free(dir);
        if (rc) return rc;
    }
    return 0;
}

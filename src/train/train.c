#include "train/train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/json_file.h"
#include "image/tone.h"
#include "train/trainer.h"

static void free_trainer(Trainer *trainer)
{
    fs_views_free(trainer);
    fs_engine_state_free(&trainer->state);
    free(trainer->neighbour);
    fs_scene_free(&trainer->scene);
    fs_engine_free(trainer->engine);
    fs_threads_free(trainer->threads);
}

static int send_neighbours(Trainer *trainer, FsError *err)
{
    if (trainer->neighbour) return fs_engine_neighbours(trainer->engine, trainer->neighbour, err);
    return fs_densify_neighbours(trainer, err);
}

// From the start, or from the checkpoint where that is wanted and there is one: 1.
static int load_scene(Trainer *trainer, FsError *err)
{
    const FsProject *project = trainer->project;
    int rc, resumed = 0;
    if (project->set.resume) {
        TRY(resumed = fs_checkpoint_read(trainer, err));
        if (resumed) fs_log_info(&project->log, "train: goes on from the checkpoint at step %d", trainer->step);
        if (!resumed) fs_log_info(&project->log, "train: no checkpoint to resume; begins at step 0");
    }
    if (!resumed) {
        TRY(fs_scene_read(&trainer->scene, fs_file_at("%s/start", project->out).text, err));
        fs_scene_lift(&trainer->scene, trainer->lift);
    }
    TRY(fs_engine_scene_up(trainer->engine, &trainer->scene, err));
    if (resumed) TRY(fs_engine_state_up(trainer->engine, &trainer->state, err));
    TRY(send_neighbours(trainer, err));
    rc = resumed;
fail:
    return rc;
}

int fs_train_begin(Trainer *trainer, FsError *err)
{
    MUST(fs_engine_scene_up(trainer->engine, &trainer->scene, err));
    return fs_densify_neighbours(trainer, err);
}

// The scene is up as it starts, before and after.
static int look_around(Trainer *trainer, FsError *err)
{
    int (*const look[])(Trainer *, FsError *) = {fs_pane_look, fs_photographer_find};
    for (int k = 0; k < 2; k++) {
        MUST(look[k](trainer, err));
        MUST(fs_train_begin(trainer, err));
    }
    return 0;
}

// Stops a run that went wrong while the last checkpoint is still good.
static int check_health(Trainer *trainer, FsError *err)
{
    for (int k = 0; k < LOSS_TERMS; k++)
        if (!isfinite(trainer->last.loss[k]))
            return fs_error_set(err, FS_ERR_NUMERIC,
                                "training: the %s term is not finite at step %d; the last checkpoint "
                                "is kept; check the photos' exposure and masks",
                                fs_loss_terms[k].name, trainer->step);
    return 0;
}

static int keep_watch(Trainer *trainer, FsError *err)
{
    const Settings *set = trainer->set;
    int rc = check_health(trainer, err);
    if (rc < 0) return rc;
    for (int k = 0; k < LOSS_TERMS; k++) {
        double smoothed = 0.97 * (double)trainer->smoothed[k] + 0.03 * trainer->last.loss[k];
        trainer->smoothed[k] = (float)(trainer->step > 1 ? smoothed : trainer->last.loss[k]);
    }
    bool last = trainer->step == set->steps;
    if (trainer->step % 20 == 0 || last) rc = fs_progress_log(trainer, last, err);
    int every = set->progress_every;
    if (rc == 0 && every && (trainer->step % every == 0 || trainer->step == every / 5 || last)) // the first one soon
        rc = fs_progress_sheet(trainer, err);
    if (rc == 0 && !last && set->checkpoint_every && trainer->step % set->checkpoint_every == 0)
        rc = fs_checkpoint_write(trainer, err);
    return rc;
}

static int train_loop(Trainer *trainer, FsError *err)
{
    int rc = 0;
    trainer->begin = fs_clock_seconds();
    trainer->first_step = trainer->step;
    while (trainer->step < trainer->set->steps) {
        if (fs_log_cancelled(&trainer->project->log)) {
            TRY(fs_checkpoint_write(trainer, err));
            rc = fs_error_set(err, FS_ERR_CANCELLED, "stopped at step %d of %d; go on with --resume", trainer->step,
                              trainer->set->steps);
            goto fail;
        }
        TRY(fs_views_for_step(trainer, trainer->step, err));
        StepArgs args;
        fs_schedule_step(trainer->set, &trainer->scene, trainer->step, &args);
        args.learn = trainer->learn;
        args.view = fs_views_at_step(trainer, trainer->step);
        TRY(fs_passers_by_watch(trainer, &args, err));
        const Camera *camera = &trainer->views[args.view]->camera;
        fs_schedule_stride(trainer->set, trainer->halvings, (double)camera->width * camera->height, trainer->budget,
                           args.stride);
        TRY(fs_engine_step(trainer->engine, &args, &trainer->last, err));
        trainer->step++;
        TRY(fs_densify_step(trainer, err));
        TRY(keep_watch(trainer, err));
    }
    fs_log_info(&trainer->project->log, "train: %d steps in %.1f s", trainer->step - trainer->first_step,
                fs_clock_seconds() - trainer->begin);
fail:
    return rc;
}

// beta's unit is free while R learns (scene.h: Pane); in the end it is the reflectance that T's dimming shows.
static void fix_unit_of_R(Scene *scene)
{
    if (!scene->pane_beta || !scene->cloud[LAYER_R].n) return;
    float factor = fs_tone_encode((float)(scene->pane.f0 / scene->pane.dimming));
    Cloud *R = &scene->cloud[LAYER_R];
    for (int i = 0; i < 3 * R->n; i++) R->field[CLOUD_COLORS][i] *= factor;
    scene->pane.f0 = scene->pane.dimming;
}

// Rows of digits: the ninths of the mirrored light that do not arrive.
static json_t *hidden_in(const OcclusionState *state)
{
    json_t *rows = json_array();
    for (int j = 0; j < OCCLUSION_HEIGHT; j++) {
        char row[OCCLUSION_WIDTH];
        for (int i = 0; i < OCCLUSION_WIDTH; i++)
            row[i] = (char)('0' + (int)(9 * state->q[j * OCCLUSION_WIDTH + i] + 0.5f));
        json_array_append_new(rows, json_stringn(row, sizeof row));
    }
    return rows;
}

// Which share of the transmitted Gaussians hides what is mirrored.
static double covered(const Cloud *T)
{
    double sum = 0;
    for (int i = 0; i < T->n && T->width[CLOUD_COVERS]; i++) sum += (double)T->field[CLOUD_COVERS][i] / T->n;
    return sum;
}

// OUT/clouds/photos.json: the factors by which the light of each photo was found to differ, and where the photographer
// hides the mirrored scene in it, which share of it is left out for who walks by; bars: the share of T that does in all
// of them.
static int write_photos(const Trainer *trainer, FsError *err)
{
    json_t *photos = json_array();
    for (int i = 0; i < trainer->n_views; i++) {
        const float *x = trainer->photo[i].x, *w = x + PHOTO_WHITE;
        double hidden = 0, passers = 0;
        for (int k = 0; trainer->occlusion && k < OCCLUSION_CELLS; k++)
            hidden += (double)trainer->occlusion[i].q[k] / OCCLUSION_CELLS;
        for (int k = 0; trainer->passers && k < OCCLUSION_CELLS; k++)
            passers += (double)trainer->passers[i * OCCLUSION_CELLS + k] / OCCLUSION_CELLS;
        json_t *photo = json_pack("{s:s, s:f, s:f, s:f, s:[fff], s:f, s:f}", "name", trainer->views[i]->name,
                                  "transmitted", exp((double)x[PHOTO_T]), "mirrored", exp((double)x[PHOTO_R]), "flash",
                                  exp((double)x[PHOTO_FLASH]), "white_balance", exp((double)w[0]), exp((double)w[1]),
                                  exp((double)w[2]), "photographer", hidden, "passers_by", passers);
        if (trainer->occlusion) json_object_set_new(photo, "hidden", hidden_in(&trainer->occlusion[i]));
        json_array_append_new(photos, photo);
    }
    return fs_json_file_write(
        fs_file_at("%s/clouds/photos.json", trainer->project->out).text,
        json_pack("{s:o, s:f}", "photos", photos, "bars", covered(&trainer->scene.cloud[LAYER_T_N])),
        JSON_INDENT(1) | JSON_REAL_PRECISION(6), err);
}

int fs_train_run(FsProject *project, FsError *err)
{
    if (fs_project_done(project, FS_STAGE_TRAIN)) return 0;
    int rc, resumed;
    Trainer trainer = {.project = project, .set = &project->set};
    FilePath clouds = fs_file_at("%s/clouds", project->out);
    TRY(fs_engine_new(&trainer.engine, project->set.device, project->set.cpu, project->set.threads, err));
    if (!(trainer.threads = fs_threads_new(project->set.threads))) TRY(fs_error_memory(err));
    TRY(fs_views_load(&trainer, err));
    TRY(fs_lamps_behind_read(&trainer, err));
    TRY(resumed = load_scene(&trainer, err));
    RunSize size = fs_trainer_size(&trainer);
    TRY(fs_cost_check(&size, fs_train_bytes(trainer.set, &size), err));
    TRY(fs_project_begin(project, FS_STAGE_TRAIN, NULL, 0, err));
    TRY(fs_progress_log_rewind(&trainer, err));
    if (!resumed) TRY(look_around(&trainer, err));
    fs_passers_by_announce(&trainer);
    TRY(train_loop(&trainer, err));
    TRY(fs_checkpoint_write(&trainer, err));
    fix_unit_of_R(&trainer.scene);
    fs_scene_lift(&trainer.scene, 1 / trainer.lift);
    TRY(fs_file_mkdirs(clouds.text, err));
    TRY(fs_scene_write(&trainer.scene, clouds.text, err));
    TRY(write_photos(&trainer, err));
    TRY(fs_project_mark_done(project, FS_STAGE_TRAIN, err));
fail:
    free_trainer(&trainer);
    return rc;
}

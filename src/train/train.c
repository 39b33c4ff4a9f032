#include "train/train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/file.h"
#include "image/tone.h"
#include "train/trainer.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int allocate_scratch(Trainer *trainer, FsError *err)
{
    int threads = fs_threads_count(trainer->engine->threads);
    trainer->strip_sum = calloc((size_t)(trainer->tallest / 32 + 2) * LOSS_TERMS, sizeof(double));
    trainer->photometric_scratch = calloc((size_t)threads, sizeof(void *));
    if (!trainer->strip_sum || !trainer->photometric_scratch) return fs_error_memory(err);
    for (int i = 0; i < threads; i++) {
        size_t size = (fs_photometric_scratch(trainer->longest_width) + 63) / 64 * 64;
        if (!(trainer->photometric_scratch[i] = aligned_alloc(64, size))) return fs_error_memory(err);
    }
    return 0;
}

static void free_trainer(Trainer *trainer)
{
    if (trainer->photometric_scratch)
        for (int i = 0; i < fs_threads_count(trainer->engine->threads); i++) free(trainer->photometric_scratch[i]);
    free(trainer->photometric_scratch);
    free(trainer->strip_sum);
    fs_views_free(trainer);
    fs_optimise_free(trainer);
    fs_scene_free(&trainer->scene);
    fs_engine_free(trainer->engine);
}

static int load_scene(Trainer *trainer, FsError *err)
{
    const FsProject *project = trainer->project;
    int rc = 0;
    if (project->set.resume) {
        rc = fs_checkpoint_read(trainer, err);
        if (rc > 0) fs_log_info(&project->log, "train: goes on from the checkpoint at step %d", trainer->step);
        if (rc == 0) fs_log_info(&project->log, "train: no checkpoint to resume; begins at step 0");
        if (rc) return rc;
    }
    char *start = fs_file_path("%s/start", project->out);
    if (!start) return fs_error_memory(err);
    TRY(fs_scene_read(&trainer->scene, start, err));
    TRY(fs_optimise_init(trainer, err));
fail:
    free(start);
    return rc;
}

// Stops a run that went wrong while the last checkpoint is still good.
static int check_health(Trainer *trainer, FsError *err)
{
    for (int k = 0; k < LOSS_TERMS; k++)
        if (!isfinite(trainer->loss[k]))
            return fs_error_set(err, FS_ERR_NUMERIC,
                                "training: the %s term is not finite at step %d; the last checkpoint "
                                "is kept; check the photos' exposure and masks",
                                fs_loss_names[k], trainer->step);
    return 0;
}

static int keep_watch(Trainer *trainer, double begin, FsError *err)
{
    const Settings *set = trainer->set;
    int rc = check_health(trainer, err);
    if (rc < 0) return rc;
    for (int k = 0; k < LOSS_TERMS; k++)
        trainer->smoothed[k] = trainer->step - trainer->first_step <= 1
                                   ? trainer->loss[k]
                                   : 0.97 * trainer->smoothed[k] + 0.03 * trainer->loss[k];
    bool last = trainer->step == set->steps;
    if (trainer->step % 20 == 0 || last) rc = fs_progress_log(trainer, now() - begin, last, err);
    if (rc == 0 && set->progress_every && (trainer->step % set->progress_every == 0 || last))
        rc = fs_progress_sheet(trainer, err);
    if (rc == 0 && !last && set->checkpoint_every && trainer->step % set->checkpoint_every == 0)
        rc = fs_checkpoint_write(trainer, err);
    return rc;
}

static int train_loop(Trainer *trainer, FsError *err)
{
    int rc = 0;
    double begin = now();
    trainer->first_step = trainer->step;
    if (!trainer->state[LAYER_T_N].neighbour) TRY(fs_gains_find_neighbours(trainer, err)); // else a checkpoint's
    while (trainer->step < trainer->set->steps) {
        if (fs_log_cancelled(&trainer->project->log)) {
            TRY(fs_checkpoint_write(trainer, err));
            rc = fs_error_set(err, FS_ERR_CANCELLED, "stopped at step %d of %d; go on with --resume", trainer->step,
                              trainer->set->steps);
            goto fail;
        }
        fs_step_run(trainer, fs_views_at_step(trainer, trainer->step));
        fs_optimise_step(trainer);
        TRY(fs_densify_step(trainer, err));
        TRY(keep_watch(trainer, begin, err));
    }
    fs_log_info(&trainer->project->log, "train: %d steps in %.1f s", trainer->step - trainer->first_step,
                now() - begin);
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

int fs_train_run(FsProject *project, FsError *err)
{
    if (fs_project_done(project, FS_STAGE_TRAIN)) return 0;
    int rc;
    Trainer trainer = {.project = project, .set = &project->set};
    char *clouds = fs_file_path("%s/clouds", project->out);
    if (!clouds) return fs_error_memory(err);
    TRY(fs_engine_new(&trainer.engine, project->set.cpu, project->set.threads, err));
    TRY(fs_views_load(&trainer, err));
    TRY(allocate_scratch(&trainer, err));
    TRY(load_scene(&trainer, err));
    rc = 0;
    fs_project_unmark(project, FS_STAGE_TRAIN);
    TRY(train_loop(&trainer, err));
    fix_unit_of_R(&trainer.scene);
    TRY(fs_file_mkdirs(clouds, err));
    TRY(fs_scene_write(&trainer.scene, clouds, err));
    TRY(fs_checkpoint_write(&trainer, err));
    TRY(fs_project_mark_done(project, FS_STAGE_TRAIN, err));
fail:
    free(clouds);
    free_trainer(&trainer);
    return rc;
}

// The photos of training: which, and in what order.
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/rng.h"
#include "train/trainer.h"

static bool wanted(const View *view, const char *lighting)
{
    return !view->held_out && (strcmp(lighting, "both") == 0 || view->flash == (strcmp(lighting, "flash") == 0));
}

static int load_view(Trainer *trainer, const View *view, FsError *err)
{
    Image photo = {0}, mask = {0};
    int rc;
    TRY(fs_dataset_load_view(trainer->project->out, view, &photo, &mask, err));
    TRY(fs_engine_load_view(trainer->engine, &(EngineView){&view->camera, view->flash, &photo, &mask}, err));
    trainer->views[trainer->n_views++] = view;
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    return rc;
}

int fs_views_load(Trainer *trainer, FsError *err)
{
    int rc;
    char *path = fs_file_path("%s/views.json", trainer->project->out);
    if (!path) return fs_error_memory(err);
    TRY(fs_dataset_read(&trainer->dataset, path, err));
    trainer->views = calloc((size_t)trainer->dataset.n + 1, sizeof *trainer->views);
    trainer->order = calloc((size_t)trainer->dataset.n + 1, sizeof *trainer->order);
    trainer->epoch = -1;
    if (!trainer->views || !trainer->order) TRY(fs_error_memory(err));
    for (int i = 0; i < trainer->dataset.n; i++)
        if (wanted(&trainer->dataset.view[i], trainer->set->lighting))
            TRY(load_view(trainer, &trainer->dataset.view[i], err));
    if (trainer->n_views == 0)
        rc = fs_error_set(err, FS_ERR_INPUT,
                          "%s: no photos to train on (all are held out, or of the other lighting); "
                          "use a larger --test-every",
                          path);
fail:
    free(path);
    return rc;
}

void fs_views_free(Trainer *trainer)
{
    free(trainer->views);
    free(trainer->order);
    fs_dataset_free(&trainer->dataset);
}

int fs_views_at_step(Trainer *trainer, int step)
{
    int n = trainer->n_views, epoch = step / n, *order = trainer->order;
    if (epoch != trainer->epoch) {
        Rng rng = fs_rng_new((uint64_t)trainer->set->seed * 1000003u + (uint64_t)epoch);
        for (int i = 0; i < n; i++) order[i] = i;
        for (int i = n - 1; i > 0; i--) {
            int j = fs_rng_below(&rng, i + 1), swap = order[i];
            order[i] = order[j];
            order[j] = swap;
        }
        trainer->epoch = epoch;
    }
    return order[step % n];
}

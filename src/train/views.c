// The photos of training: which, and in what order.
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/rng.h"
#include "train/trainer.h"

static bool wanted(const View *view, const char *lighting)
{
    return fs_dataset_trains(view) &&
           (strcmp(lighting, "both") == 0 || view->flash == (strcmp(lighting, "flash") == 0));
}

// The photo as a camera of fewer pixels takes it: light is averaged. A pixel is trusted where all of it is.
static int shrink(Image *photo, Image *mask, const Camera *to, FsError *err)
{
    Image *both[2] = {photo, mask};
    for (int k = 0; k < 2; k++) {
        Image small = {0};
        MUST(fs_image_resize_area(both[k], to->width, to->height, &small, err));
        fs_image_free(both[k]);
        *both[k] = small;
    }
    for (size_t i = 0; i < (size_t)mask->width * (size_t)mask->height; i++) mask->px[i] = mask->px[i] > 0.999f;
    return 0;
}

int fs_views_halvings(int long_edge, int side)
{
    int halvings = 0;
    while (long_edge >> halvings > side) halvings++;
    return halvings;
}

int fs_views_photo(const Trainer *trainer, int number, int halvings, Camera *camera, Image *photo, Image *mask,
                   FsError *err)
{
    const View *view = trainer->views[number];
    *camera = fs_camera_limited(&view->camera, fs_camera_longer_side(&view->camera) >> halvings);
    MUST(fs_dataset_load_view(trainer->project->out, view, photo, mask, err));
    return halvings ? shrink(photo, mask, camera, err) : 0;
}

static int load_view(const Trainer *trainer, int number, int halvings, FsError *err)
{
    const View *view = trainer->views[number];
    Image photo = {0}, mask = {0};
    Camera camera;
    int rc;
    TRY(fs_views_photo(trainer, number, halvings, &camera, &photo, &mask, err));
    fs_passers_by_mask(trainer, number, &photo, &mask);
    const unsigned char *lamps = trainer->lamps ? trainer->lamps + (size_t)OCCLUSION_CELLS * (size_t)number : NULL;
    TRY(fs_engine_load_view(trainer->engine,
                            &(EngineView){&camera, view->flash, &photo, &mask, trainer->photo[number],
                                          (float)view->flash_gain, (float)view->exposure_gain, lamps},
                            err));
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    return rc;
}

int fs_views_load_halved(Trainer *trainer, int halvings, FsError *err)
{
    fs_engine_drop_views(trainer->engine);
    for (int i = 0; i < trainer->n_views; i++) MUST(load_view(trainer, i, halvings, err));
    trainer->halvings = halvings;
    return fs_photographer_up(trainer, err);
}

int fs_views_for_step(Trainer *trainer, int step, FsError *err)
{
    int halvings = fs_schedule_halvings(trainer->set, trainer->long_edge, step);
    if (halvings == trainer->halvings) return 0;
    if (trainer->halvings >= 0) {
        MUST(fs_engine_photos_down(trainer->engine, trainer->photo, err));
        MUST(fs_photographer_down(trainer, err));
    }
    if (halvings == 0) MUST(fs_passers_by_find(trainer, err));
    MUST(fs_views_load_halved(trainer, halvings, err));
    fs_log_info(&trainer->project->log, "train: photos of %d pixels from step %d on", trainer->long_edge >> halvings,
                step + 1);
    return 0;
}

static void add_view(Trainer *trainer, const View *view)
{
    const Camera *camera = &view->camera;
    trainer->views[trainer->n_views++] = view;
    int budget = fs_schedule_budget(trainer->set, (double)camera->width * camera->height);
    if (fs_camera_longer_side(camera) > trainer->long_edge) trainer->long_edge = fs_camera_longer_side(camera);
    if (budget > trainer->budget) trainer->budget = budget;
}

int fs_views_load(Trainer *trainer, FsError *err)
{
    int rc;
    char *path = fs_file_path("%s/views.json", trainer->project->out);
    if (!path) return fs_error_memory(err);
    TRY(fs_dataset_read(&trainer->dataset, path, err));
    trainer->views = calloc((size_t)trainer->dataset.n + 1, sizeof *trainer->views);
    trainer->order = calloc((size_t)trainer->dataset.n + 1, sizeof *trainer->order);
    trainer->photo = calloc((size_t)trainer->dataset.n + 1, sizeof *trainer->photo);
    trainer->epoch = trainer->halvings = -1;
    fs_dataset_leave_blurred(&trainer->dataset, trainer->set->least_sharpness);
    trainer->lift = fs_dataset_lift(&trainer->dataset, fs_settings_brightness(trainer->set));
    if (!trainer->views || !trainer->order || !trainer->photo) TRY(fs_error_memory(err));
    for (int i = 0; i < trainer->dataset.n; i++)
        if (wanted(&trainer->dataset.view[i], trainer->set->lighting)) add_view(trainer, &trainer->dataset.view[i]);
    bool encoded = true; // of one kind: a curve of the JPEGs would bend the RAWs among them
    for (int i = 0; i < trainer->n_views; i++) encoded &= trainer->views[i]->encoded;
    trainer->learn = fs_schedule_learns(trainer->set, encoded);
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
    free(trainer->photo);
    free(trainer->occlusion);
    free(trainer->residual);
    free(trainer->passers);
    free(trainer->lamps);
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

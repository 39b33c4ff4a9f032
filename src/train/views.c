// The photos of training, tone-mapped and as planes.
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/rng.h"
#include "image/tone.h"
#include "train/trainer.h"

static int new_planes(Planes *p, int width, int height, int channels, FsError *err)
{
    *p = (Planes){width, height, channels, fs_planes_stride(width), NULL};
    size_t size = sizeof(float) * (size_t)channels * (size_t)height * (size_t)p->stride;
    p->px = aligned_alloc(64, (size + 63) / 64 * 64);
    if (!p->px) return fs_error_memory(err);
    memset(p->px, 0, size);
    return 0;
}

static bool wanted(const View *view, const char *lighting)
{
    return !view->held_out && (strcmp(lighting, "both") == 0 || view->flash == (strcmp(lighting, "flash") == 0));
}

static void from_image(const Image *image, const Planes *planes, bool encode)
{
    for (int c = 0; c < planes->channels; c++)
        for (int y = 0; y < planes->height; y++) {
            float *row = fs_planes_row(planes, c, y);
            const float *px = image->px + (size_t)y * (size_t)image->width * (size_t)image->channels + c;
            for (int x = 0; x < planes->width; x++)
                row[x] = encode ? fs_tone_encode(px[x * image->channels]) : px[x * image->channels];
        }
}

static int load_view(Trainer *trainer, const View *view, TrainView *out, FsError *err)
{
    Image photo = {0}, mask = {0};
    int rc;
    *out = (TrainView){.view = view};
    int w = view->camera.width, h = view->camera.height;
    TRY(fs_dataset_load_view(trainer->project->out, view, &photo, &mask, err));
    TRY(new_planes(&out->photo, w, h, 3, err));
    TRY(new_planes(&out->mask, w, h, 1, err));
    TRY(new_planes(&out->mu, w, h, 3, err));
    TRY(new_planes(&out->var, w, h, 3, err));
    from_image(&photo, &out->photo, true);
    from_image(&mask, &out->mask, false);
    void *scratch = aligned_alloc(64, (fs_photometric_scratch(w) + 63) / 64 * 64);
    if (!scratch) TRY(fs_error_memory(err));
    PhotometricArgs args = {
        .I = &out->photo, .Y = &out->photo, .mu_Y = &out->mu, .var_Y = &out->var, .scratch = scratch};
    trainer->engine->kernels.photometric->target_stats(&args, 0, h);
    free(scratch);
    if (w > trainer->longest_width) trainer->longest_width = w;
    if (h > trainer->tallest) trainer->tallest = h;
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
    if (!trainer->views) TRY(fs_error_memory(err));
    for (int i = 0; i < trainer->dataset.n; i++) {
        const View *view = &trainer->dataset.view[i];
        if (!wanted(view, trainer->set->lighting)) continue;
        TRY(load_view(trainer, view, &trainer->views[trainer->n_views++], err));
    }
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
    for (int i = 0; i < trainer->n_views; i++) {
        free(trainer->views[i].photo.px);
        free(trainer->views[i].mask.px);
        free(trainer->views[i].mu.px);
        free(trainer->views[i].var.px);
    }
    free(trainer->views);
    fs_dataset_free(&trainer->dataset);
}

const TrainView *fs_views_at_step(const Trainer *trainer, int step)
{
    int n = trainer->n_views, epoch = step / n, order[1024];
    if (n > 1024) return &trainer->views[step % n];
    Rng rng = fs_rng_new((uint64_t)trainer->set->seed * 1000003u + (uint64_t)epoch);
    for (int i = 0; i < n; i++) order[i] = i;
    for (int i = n - 1; i > 0; i--) {
        int j = fs_rng_below(&rng, i + 1), swap = order[i];
        order[i] = order[j];
        order[j] = swap;
    }
    return &trainer->views[order[step % n]];
}

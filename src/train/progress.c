// What a person sees of training: the progress line, log.jsonl, contact sheets.
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/file.h"
#include "image/sheet.h"
#include "image/tone.h"
#include "model/preview.h"
#include "train/trainer.h"

#define MAX_LOG ((size_t)1 << 30)
enum { SHEET_EDGE = 600 }; // pixels of a picture's longer side on a contact sheet, at most

// One of this lighting, a quarter on in their order; NULL: there is none.
static const View *view_to_show(const Trainer *trainer, bool flash)
{
    const View *view = NULL;
    for (int i = 0, found = 0; i < trainer->n_views; i++)
        if (trainer->views[i]->flash == flash && (!view || ++found <= trainer->n_views / 4)) view = trainer->views[i];
    return view;
}

// A row: photo, composite, T, R, beta. What is looked at in passing need not be of full size, which takes seconds to
// write; render's pictures are.
static int show(const Trainer *trainer, const View *view, const PreviewLight *light, const Image *photo,
                Image picture[5], SheetTile tiles[5], FsError *err)
{
    const RenderLayer layers[4] = {view->flash ? RENDER_I_F : RENDER_I_N, view->flash ? RENDER_T_F : RENDER_T_N,
                                   RENDER_R, RENDER_BETA};
    int rc;
    Renders renders = {0};
    TRY(fs_engine_render(trainer->engine, &view->camera, &renders, err));
    TRY(fs_preview_picture(photo, 0, light, &picture[0], err));
    tiles[0] = (SheetTile){&picture[0], view->name};
    for (int k = 0; k < 4; k++) {
        const Image *image = &renders.layer[layers[k]];
        TRY(layers[k] == RENDER_BETA ? fs_preview_shrink(image, SHEET_EDGE, &picture[1 + k], err)
                                     : fs_preview_picture(image, SHEET_EDGE, light, &picture[1 + k], err));
        tiles[1 + k] = (SheetTile){&picture[1 + k], fs_render_layers[layers[k]].name};
    }
fail:
    fs_engine_renders_free(&renders);
    return rc;
}

// Two rows: a photo without flash, a photo with it; one exposure for both.
int fs_progress_sheet(Trainer *trainer, FsError *err)
{
    int rc = 0, rows = 0;
    const View *view[2];
    SheetTile tiles[10];
    Image full = {0}, photo[2] = {0}, picture[10] = {0};
    TRY(fs_file_mkdirs(fs_file_at("%s/progress", trainer->project->out).text, err));
    for (int flash = 0; flash < 2; flash++) {
        if (!(view[rows] = view_to_show(trainer, flash == 1))) continue;
        TRY(fs_dataset_load_view(trainer->project->out, view[rows], &full, NULL, err));
        TRY(fs_preview_shrink(&full, SHEET_EDGE, &photo[rows], err));
        fs_image_free(&full);
        rows++;
    }
    PreviewLight light = {.exposure = fs_tone_pleasant_exposure(photo, rows)};
    fs_preview_matrix(trainer->project->out, &light);
    for (int r = 0; r < rows; r++) TRY(show(trainer, view[r], &light, &photo[r], picture + 5 * r, tiles + 5 * r, err));
    TRY(fs_sheet_write(fs_file_at("%s/progress/%05d.png", trainer->project->out, trainer->step).text, tiles, 5 * rows,
                       5, err));
fail:
    fs_image_free(&full);
    for (int r = 0; r < 2; r++) fs_image_free(&photo[r]);
    for (int i = 0; i < 10; i++) fs_image_free(&picture[i]);
    return rc;
}

// What is said while it goes on: speed, terms with a weight, splats.
static char *progress_text(const Trainer *trainer, double seconds)
{
    double rate = seconds > 0 ? (trainer->step - trainer->first_step) / seconds : 0;
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f) return NULL;
    fprintf(f, "%.1f steps/s, %.0f s left", rate, rate > 0 ? (trainer->set->steps - trainer->step) / rate : 0);
    for (int k = 0; k < LOSS_TERMS; k++)
        if (trainer->smoothed[k] != 0) fprintf(f, ", %s %.4f", fs_loss_terms[k].name, trainer->smoothed[k]);
    if (!fs_radiance_is(&trainer->scene.field)) fprintf(f, ", splats");
    for (int l = 0; l < LAYERS; l++)
        if (trainer->scene.cloud[l].n) fprintf(f, " %s %d", fs_layers[l].name, trainer->scene.cloud[l].n);
    if (fclose(f) == 0) return text;
    free(text);
    return NULL;
}

int fs_progress_log(Trainer *trainer, bool last, FsError *err)
{
    double seconds = fs_clock_seconds() - trainer->begin;
    char *text = progress_text(trainer, seconds), *line = NULL;
    size_t size;
    FILE *f = NULL;
    int rc;
    if (!text) TRY(fs_error_memory(err));
    TRY(fs_engine_scene_down(trainer->engine, 0, &trainer->scene, err));
    fs_log_progress(&trainer->project->log, "train", trainer->step, trainer->set->steps, text);
    if (trainer->step % 100 && !last) goto fail;
    f = open_memstream(&line, &size);
    if (f) {
        fprintf(f, "{\"step\": %d, \"seconds\": %.2f", trainer->step, trainer->seconds + seconds);
        for (int k = 0; k < LOSS_TERMS; k++) fprintf(f, ", \"%s\": %.6g", fs_loss_terms[k].name, trainer->smoothed[k]);
        for (int l = 0; l < LAYERS; l++)
            fprintf(f, ", \"splats_%s\": %d", fs_layers[l].name, trainer->scene.cloud[l].n);
        fprintf(f, ", \"gain_color\": [%.4f, %.4f, %.4f]", trainer->scene.gain_color[0], trainer->scene.gain_color[1],
                trainer->scene.gain_color[2]);
        const double *n = trainer->scene.pane.normal;
        fprintf(f, ", \"pane\": [%.4f, %.4f, %.4f], \"dimming\": %.4f, \"flash_return\": %.4f}\n", n[0], n[1], n[2],
                trainer->scene.pane.dimming, trainer->scene.flash_return);
    }
    rc = f && fclose(f) == 0 && line ? fs_file_append(fs_file_at("%s/log.jsonl", trainer->project->out).text, line, err)
                                     : fs_error_memory(err);
fail:
    free(text);
    free(line);
    return rc;
}

// The lines are in the order of their steps.
int fs_progress_log_rewind(Trainer *trainer, FsError *err)
{
    FilePath path = fs_file_at("%s/log.jsonl", trainer->project->out);
    char *text;
    size_t size, kept = 0;
    if (!fs_file_exists(path.text)) return 0;
    MUST(fs_file_read(path.text, MAX_LOG, &text, &size, err));
    unsigned failures = fs_error_memory_failures();
    for (size_t n; kept < size; kept += n) {
        n = strcspn(text + kept, "\n") + 1;
        json_t *line = kept + n <= size ? json_loadb(text + kept, n, 0, NULL) : NULL;
        json_int_t step = json_integer_value(json_object_get(line, "step"));
        json_decref(line);
        if (step < 1 || step > trainer->step) break;
    }
    int rc = 0;
    if (fs_error_memory_failures() != failures) // a line that could not be read is none that comes after
        rc = fs_error_memory(err);
    else if (kept < size)
        rc = fs_file_write(path.text, text, kept, err);
    free(text);
    return rc;
}

#include "export/clean.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "engine/as_shot.h"
#include "export/clean_file.h"
#include "export/clean_photo.h"
#include "image/bicubic.h"

#define CHANGED 0.01 // mean difference to the working image, of its mean: another photo
#define WIDER 1.5    // a pinhole picture that holds a distorted one is at most so many times as wide

typedef struct Clean {
    const CleanArgs *args;
    Engine *engine;
    Threads *threads;
    Renders renders;
    AsShot as_shot;
} Clean;

// What one photo holds: at full size and at working size.
typedef struct Work {
    const View *view;
    CleanPicture picture;
    Image clipped, small, small_clipped, masked;
    float white; // as PhotoSizes has it
    CleanGuide guide;
} Work;

static void free_work(Work *w)
{
    fs_image_free(&w->picture.rgb);
    fs_image_free(&w->clipped);
    fs_image_free(&w->small);
    fs_image_free(&w->small_clipped);
    fs_image_free(&w->masked);
    fs_clean_photo_free(&w->guide);
}

// ---- the photo ----

// read: its size, upright.
static int check_size(const Work *w, const int read[2], FsError *err)
{
    const Camera *camera = &w->view->camera;
    if (w->small.width == camera->width && w->small.height == camera->height) return 0;
    return fs_error_input(err,
                          "%s: %d x %d pixels, which is not the shape of the photo that was ingested: has it been "
                          "cropped or turned? Put the original back, or ingest anew",
                          w->picture.path.text, read[0], read[1]);
}

// Against the working image that ingest made of it; finds what was masked.
static int check_content(const Clean *c, Work *w, FsError *err)
{
    Image was = {0}, mask = {0};
    const char *out = c->args->project->out;
    double sum = 0, differs = 0, gain = w->picture.photo.gain;
    int rc;
    TRY(fs_tiff_read(fs_file_at("%s/linear/%s.tif", out, w->view->name).text, &was, err));
    TRY(fs_png_read(fs_file_at("%s/linear/%s_mask.png", out, w->view->name).text, &mask, err));
    if (was.width != w->small.width || was.height != w->small.height || was.channels != 3 || mask.width != was.width ||
        mask.height != was.height || mask.channels != 1)
        TRY(fs_error_input(err, "%s/linear/%s.tif: not what the stage ingest writes; rerun it with --force", out,
                           w->view->name));
    TRY(fs_image_new(&w->masked, was.width, was.height, 1, err));
    for (size_t i = 0; i < fs_image_pixels(&mask); i++) {
        bool black = was.px[3 * i] == 0 && was.px[3 * i + 1] == 0 && was.px[3 * i + 2] == 0;
        w->masked.px[i] = mask.px[i] < 0.5f && (black || !(w->small_clipped.px[i] > 0));
    }
    for (size_t i = 0; i < fs_image_values(&was); i++) {
        if (w->masked.px[i / 3] > 0) continue; // black in what was ingested
        sum += fabs((double)was.px[i]);
        differs += fabs((double)was.px[i] - gain * (double)w->small.px[i]);
    }
    if (!(differs <= CHANGED * sum))
        TRY(fs_error_input(err,
                           "%s: is another picture than the one that was ingested: put the original back, or "
                           "ingest anew",
                           w->picture.path.text));
fail:
    fs_image_free(&was);
    fs_image_free(&mask);
    return rc;
}

// At working size, and at its full size where that is wanted; then whether it is the one that was ingested.
static int read_photo(const Clean *c, Work *w, bool full, FsError *err)
{
    const Photos *photos = &c->args->originals->photos;
    PhotoFile *photo = &w->picture.photo;
    const Camera *camera = &w->view->camera;
    int longer = camera->width > camera->height ? camera->width : camera->height, rc;
    PhotoSizes sizes = {.n = full ? 2 : 1, .size = {{.long_edge = longer}, {.long_edge = 0}}};
    PhotoLight light;
    const SensorLevels levels = fs_photos_developed(photos);
    TRY(fs_photo_read_info(w->picture.path.text, &photo->exif, photo->white_balance, NULL, err));
    TRY(fs_photo_read(w->picture.path.text, &levels, &sizes, &light, err));
    w->picture.encoded = light >= PHOTO_ENCODED;
    w->white = sizes.white;
    Image *const from[4] = {&sizes.size[0].rgb, &sizes.size[0].clipped, &sizes.size[1].rgb, &sizes.size[1].clipped},
                 *const to[4] = {&w->small, &w->small_clipped, &w->picture.rgb, &w->clipped};
    bool turned = photo->exif.orientation > 4;
    for (int i = 0; i < 2 * sizes.n; i++) {
        TRY(fs_image_orient(from[i], photo->exif.orientation, err));
        *to[i] = *from[i];
        *from[i] = (Image){0};
    }
    TRY(check_size(w, (int[]){turned ? sizes.height : sizes.width, turned ? sizes.width : sizes.height}, err));
    TRY(check_content(c, w, err));
fail:
    fs_sizes_free(&sizes);
    return rc;
}

// ---- the renders ----

// The pinhole camera of a lens, wide enough to see all that the photo shows.
static int wide_camera(const Lens *lens, const View *view, Camera *camera, FsError *err)
{
    MUST(fs_lens_camera(lens, view->name, camera, err));
    memcpy(camera->w2c, view->camera.w2c, sizeof camera->w2c);
    double more = fs_lens_widening(lens, WIDER) - 1;
    double left = ceil(more * camera->cx), top = ceil(more * camera->cy);
    camera->width += (int)(left + ceil(more * (camera->width - camera->cx)));
    camera->height += (int)(top + ceil(more * (camera->height - camera->cy)));
    camera->cx += left;
    camera->cy += top;
    return 0;
}

typedef struct Bend {
    const Lens *lens;
    const Camera *camera; // of the images
    const Image *from;    // (2)
    Image *to;            // (2)
} Bend;

// At a place between the pixels' middles.
static void sample(const Image *image, double u, double v, float rgb[3])
{
    int x0 = (int)floor(u) - 1, y0 = (int)floor(v) - 1;
    float wx[4], wy[4];
    fs_bicubic_weights((float)(u - x0 - 1), wx);
    fs_bicubic_weights((float)(v - y0 - 1), wy);
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            int x = x0 + i < 0 ? 0 : x0 + i >= image->width ? image->width - 1 : x0 + i;
            int y = y0 + j < 0 ? 0 : y0 + j >= image->height ? image->height - 1 : y0 + j;
            const float *px = fs_image_at(image, x, y);
            for (int c = 0; c < 3; c++) rgb[c] += wx[i] * wy[j] * px[c];
        }
    for (int c = 0; c < 3; c++) rgb[c] = fmaxf(rgb[c], 0);
}

static void bend_row(void *context, int y, int worker)
{
    (void)worker;
    const Bend *b = context;
    for (int x = 0; x < b->lens->width; x++) {
        const double pixel[2] = {x + 0.5, y + 0.5};
        double ray[2];
        if (!fs_lens_unproject(b->lens, pixel, ray)) { // as if there were no distortion
            Camera plain;
            fs_lens_camera(b->lens, "", &plain, NULL);
            ray[0] = (pixel[0] - plain.cx) / plain.fx;
            ray[1] = (pixel[1] - plain.cy) / plain.fy;
        }
        double u = b->camera->fx * ray[0] + b->camera->cx - 0.5, v = b->camera->fy * ray[1] + b->camera->cy - 0.5;
        u = fmin(fmax(u, 0), b->camera->width - 1), v = fmin(fmax(v, 0), b->camera->height - 1);
        for (int i = 0; i < 2; i++) sample(&b->from[i], u, v, fs_image_at(&b->to[i], x, y));
    }
}

// From the pinhole picture into the photo's geometry.
static int bend(const Clean *c, const Lens *lens, const Camera *camera, Image layers[2], FsError *err)
{
    Image bent[2] = {{0}};
    int rc;
    TRY(fs_image_new(&bent[0], lens->width, lens->height, 3, err));
    TRY(fs_image_new(&bent[1], lens->width, lens->height, 3, err));
    fs_threads_for(c->threads, lens->height, bend_row, &(Bend){lens, camera, layers, bent});
    for (int i = 0; i < 2; i++) {
        fs_image_free(&layers[i]);
        layers[i] = bent[i];
        bent[i] = (Image){0};
    }
fail:
    for (int i = 0; i < 2; i++) fs_image_free(&bent[i]);
    return rc;
}

static int render_guide(Clean *c, Work *w, FsError *err)
{
    const View *view = w->view;
    Camera camera = view->camera; // at working size: clouds are at their best as large as they were trained
    if (view->distorted) MUST(wide_camera(&view->lens, view, &camera, err));
    Image layers[2] = {{0}};
    int rc;
    TRY(fs_engine_render(c->engine, &camera, &c->renders, err));
    TRY(fs_as_shot_layers(&c->as_shot, view, &camera, &c->renders, layers, err));
    if (view->distorted) TRY(bend(c, &view->lens, &camera, layers, err));
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < fs_image_values(&layers[i]); k++) layers[i].px[k] /= (float)w->picture.photo.gain;
    w->guide.T = layers[0];
    w->guide.whole = layers[1];
    return 0;
fail:
    for (int i = 0; i < 2; i++) fs_image_free(&layers[i]);
    return rc;
}

// ---- all of them ----

static Work work_on(const CleanArgs *args, int v)
{
    const Originals *originals = args->originals;
    const PhotoFile *photo = &originals->photos.photo[originals->of_view[v]];
    Work w = {.view = &args->views->view[v]};
    w.picture = (CleanPicture){.name = w.view->name,
                               .photo = *photo,
                               .path = fs_photos_path(&originals->photos, photo),
                               .white_balance = originals->photos.white_balance};
    return w;
}

static int clean_one(Clean *c, int v, FsError *err)
{
    Work w = work_on(c->args, v);
    int rc;
    TRY(read_photo(c, &w, true, err));
    TRY(render_guide(c, &w, err));
    w.guide.full = w.white;
    TRY(fs_clean_photo_guide(&w.guide, &w.small, &w.small_clipped, &w.masked, err));
    TRY(fs_clean_photo_apply(&w.guide, c->threads, &w.picture.rgb, &w.clipped, err));
    fs_clean_photo_free(&w.guide);
    TRY(fs_clean_file_write(c->args, &w.picture, c->threads, err));
fail:
    free_work(&w);
    return rc;
}

// Projects of earlier versions do not say by which lens a photo was taken.
static int check_lens(const char *out, const char *name, FsError *err)
{
    Image a = {0}, b = {0};
    int rc;
    TRY(fs_tiff_read(fs_file_at("%s/linear/%s.tif", out, name).text, &a, err));
    TRY(fs_tiff_read(fs_file_at("%s/images/%s.tif", out, name).text, &b, err));
    if (fs_image_values(&a) != fs_image_values(&b) || memcmp(a.px, b.px, fs_image_values(&a) * sizeof *a.px) != 0)
        TRY(fs_error_input(err,
                           "%s/views.json: does not tell the lens of photos that are distorted: rerun the stage "
                           "poses with --force",
                           out));
fail:
    fs_image_free(&a);
    fs_image_free(&b);
    return rc;
}

// All views: each may have a camera of its own.
static int check_lenses(const CleanArgs *args, FsError *err)
{
    for (int v = 0; v < args->views->n; v++)
        if (args->views->view[v].distorted) return 0; // told
    for (int v = 0; v < args->views->n; v++) MUST(check_lens(args->project->out, args->views->view[v].name, err));
    return 0;
}

int fs_clean_check(const CleanArgs *args, FsError *err)
{
    const Log *log = &args->project->log;
    MUST(check_lenses(args, err));
    for (int v = 0; v < args->views->n; v++) {
        Work w = work_on(args, v);
        if (fs_log_cancelled(log)) return fs_error_set(err, FS_ERR_CANCELLED, "export: stopped");
        fs_log_progress(log, "export", v, args->views->n, "looking at the photos");
        int rc = read_photo(&(Clean){.args = args}, &w, false, err);
        free_work(&w);
        if (rc < 0) return rc;
    }
    return 0;
}

int fs_clean_run(const CleanArgs *args, FsError *err)
{
    const Settings *set = &args->project->set;
    const Log *log = &args->project->log;
    FilePath dir = fs_file_at("%s/export/photos", args->project->out);
    Clean c = {.args = args};
    int rc;
    TRY(check_lenses(args, err));
    c.threads = fs_threads_new(set->threads);
    if (!c.threads) TRY(fs_error_memory(err));
    TRY(fs_as_shot_open(&c.as_shot, args->scene, args->project->out, err));
    TRY(fs_engine_new(&c.engine, set->device, set->cpu, set->threads, err));
    TRY(fs_engine_scene_up(c.engine, args->scene, err));
    TRY(fs_file_mkdirs(dir.text, err));
    for (int v = 0; v < args->views->n; v++) {
        if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "export: stopped"));
        fs_log_progress(log, "export", v, args->views->n, args->views->view[v].name);
        TRY(clean_one(&c, v, err));
    }
    fs_log_info(log, "export: %d photos without the reflection, at full size: %s", args->views->n, dir.text);
fail:
    fs_as_shot_close(&c.as_shot);
    fs_engine_renders_free(&c.renders);
    fs_engine_free(c.engine);
    fs_threads_free(c.threads);
    return rc;
}

void fs_clean_wanted(const char *list, bool wanted[CLEAN_FORMATS])
{
    static const char *const names[CLEAN_FORMATS] = {"jpeg", "tiff", "dng"};
    for (int f = 0; f < CLEAN_FORMATS; f++) wanted[f] = fs_settings_has_word(list, names[f]);
}

// The order of things: scene, baked light, path, balance, then view by view the layers, the photo, its files, the
// truth.
#include "synth/synth.h"

#include <stdlib.h>

#include "base/file.h"
#include "base/owned.h"
#include "synth/nuisance.h"
#include "synth/truth_files.h"

typedef struct Synth {
    const char *out;
    FilePath truth; // <out>/truth
    Spec spec;
    Layout layout;
    Lighting lighting;
    Threads *threads;
    Shot *shot;
    int n;
    Nuisance nuisance;
    Lock lock; // one program makes a capture there
    const Log *log;
} Synth;

#define ALL_LAYERS ((1u << TRACE_LAYERS) - 1)

static int prepare(Synth *s, FsError *err)
{
    MUST(fs_layout_build(&s->layout, &s->spec, err));
    fs_log_info(s->log, "synth: seed %u: behind the pane a %s, mirrored another room (%s); %d and %d shapes",
                s->spec.seed, s->layout.name, s->layout.room_name, s->layout.behind.n, s->layout.room.n);
    MUST(fs_bake_ambient(&s->layout.behind, s->threads, err));
    MUST(fs_bake_ambient(&s->layout.room, s->threads, err));
    MUST(fs_path_plan(&s->layout, &s->spec, &s->shot, err));
    s->n = s->spec.photos + s->spec.held_out;
    MUST(fs_nuisance_draw(&s->nuisance, &s->spec, &s->layout, s->shot, err));
    return fs_trace_balance(&s->layout, &s->spec, s->shot, s->threads, &s->lighting, err);
}

// An earlier capture in the same folder is replaced, anything else there is left alone.
static int make_folders(Synth *s, FsError *err)
{
    static const char *const folders[] = {"capture", "truth", "capture/raw", "capture/jpeg"};
    for (int i = 0; i < 2; i++) MUST(fs_owned_check_tree(fs_file_at("%s/%s", s->out, folders[i]).text, err));
    for (int i = 0; i < 2; i++) MUST(fs_owned_open(fs_file_at("%s/%s", s->out, folders[i]).text, "capture", err));
    if (!fs_owned_lock(fs_file_at("%s/truth", s->out).text, &s->lock))
        return fs_error_input(err, "%s: another flashsplat makes a capture there: wait until that is done", s->out);
    for (int i = 0; i < 2; i++) fs_owned_remove(fs_file_at("%s/%s/.", s->out, folders[i]).text);
    for (int i = 0; i < 4; i++) MUST(fs_file_mkdirs(fs_file_at("%s/%s", s->out, folders[i]).text, err));
    MUST(fs_truth_files_cameras(s->truth.text, s->layout.name, s->shot, s->n, &s->spec, err));
    const Lens *lens = &s->nuisance.lens;
    return lens->width ? fs_truth_files_sparse(s->truth.text, s->shot, s->n, &s->spec, lens, err) : 0;
}

// Exposes a view's light and writes it as a RAW and a JPEG file.
static int write_photo(Synth *s, int number, const Image *light, FsError *err)
{
    const Shot *shot = &s->shot[number];
    int rc;
    Mosaic mosaic = {0};
    Image picture = {0};
    int side = s->spec.width > s->spec.height ? s->spec.width : s->spec.height;
    ShotInfo info = {shot->flash,
                     number + 1,
                     s->spec.width,
                     s->spec.height,
                     23.9,
                     (int)(36.0 * shot->camera.fx / side + 0.5),
                     s->nuisance.photo[number].exposure};
    TRY(fs_sensor_expose(light, info.exposure.iso, fs_rng_new(s->spec.seed * 100003ull + (unsigned)number), &mosaic,
                         err));
    TRY(fs_dng_write(fs_file_at("%s/capture/raw/%s.DNG", s->out, shot->name).text, &mosaic, &info, err));
    s->nuisance.photo[number].clipped = fs_sensor_clipped(&mosaic);
    TRY(fs_sensor_develop(&mosaic, info.exposure.balance, &s->nuisance.style, &picture, err));
    TRY(fs_photo_file_write_jpeg(fs_file_at("%s/capture/jpeg/%s.JPG", s->out, shot->name).text, &picture, &info, err));
fail:
    fs_sensor_mosaic_free(&mosaic);
    fs_image_free(&picture);
    return rc;
}

// A photo of an ideal camera is the sum of the layers that its lighting shows.
static int make_ideal_photo(Synth *s, int number, const Traced *traced, FsError *err)
{
    bool flash = s->shot[number].flash;
    const Image *r = &traced->layer[flash ? TRACE_R_F : TRACE_R_N];
    Image light = {0};
    MUST(fs_image_copy(&light, &traced->layer[flash ? TRACE_T_F : TRACE_T_N], err));
    for (size_t i = 0; i < fs_image_values(&light); i++) light.px[i] += r->px[i];
    int rc = write_photo(s, number, &light, err);
    fs_image_free(&light);
    return rc;
}

// One with faults has gains on each light, and rays of its own where its lens is not a pinhole.
static int make_field_photo(Synth *s, int number, Traced *traced, FsError *err)
{
    unsigned want = s->shot[number].flash ? ALL_LAYERS : 1u << TRACE_T_N | 1u << TRACE_R_N;
    Optics store;
    const Optics *optics = fs_nuisance_optics(&s->nuisance, number, &store);
    TraceRequest request = {&s->shot[number].camera, optics, want, number};
    Image light = {0}, mask = {0};
    int rc;
    if (optics && optics->n_figures) {
        TRY(fs_trace_figures(&s->layout, request, s->threads, &mask, err));
        TRY(fs_truth_files_mask(s->truth.text, &s->shot[number], &mask, err));
    }
    if (optics || !s->shot[number].truth) {
        fs_trace_free(traced);
        TRY(fs_trace_view(&s->layout, &s->spec, &s->lighting, request, s->threads, traced, err));
    }
    TRY(fs_nuisance_gather(&s->nuisance, number, s->shot[number].flash, traced, &light, err));
    TRY(write_photo(s, number, &light, err));
fail:
    fs_image_free(&light);
    fs_image_free(&mask);
    return rc;
}

static int make_view(Synth *s, int number, FsError *err)
{
    const Shot *shot = &s->shot[number];
    bool field = s->spec.field.any;
    unsigned want = shot->flash ? 1u << TRACE_T_F | 1u << TRACE_R_F : 1u << TRACE_T_N | 1u << TRACE_R_N;
    TraceRequest request = {&shot->camera, NULL, shot->truth ? ALL_LAYERS : want, number};
    Traced traced = {0};
    Geometry geometry = {0};
    int rc = 0;
    if (shot->truth || !field)
        TRY(fs_trace_view(&s->layout, &s->spec, &s->lighting, request, s->threads, &traced, err));
    if (shot->truth) TRY(fs_truth_files_layers(s->truth.text, shot, &traced, err));
    if (shot->held_out) {
        TRY(fs_trace_geometry(&s->layout, &s->lighting, &shot->camera, s->threads, &geometry, err));
        TRY(fs_truth_files_geometry(s->truth.text, shot, &geometry, err));
    } else {
        TRY(field ? make_field_photo(s, number, &traced, err) : make_ideal_photo(s, number, &traced, err));
    }
fail:
    fs_trace_free(&traced);
    fs_trace_geometry_free(&geometry);
    return rc;
}

int fs_synth_run(const char *out, const FsSettings *settings, const Log *log, FsError *err)
{
    int rc;
    Synth s = {.out = out, .log = log, .truth = fs_file_at("%s/truth", out)};
    TRY(fs_spec_read(&s.spec, settings, err));
    s.threads = fs_threads_new(settings->threads);
    TRY(s.threads ? 0 : fs_error_memory(err));
    TRY(prepare(&s, err));
    if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "%s: stopped before the first view", out));
    TRY(make_folders(&s, err));
    for (int i = 0; i < s.n; i++) {
        fs_log_progress(log, "synth", i, s.n, s.shot[i].name);
        if (fs_log_cancelled(log))
            TRY(fs_error_set(err, FS_ERR_CANCELLED, "%s: stopped after %d of %d views", out, i, s.n));
        TRY(make_view(&s, i, err));
    }
    if (s.spec.field.any) TRY(fs_nuisance_write(&s.nuisance, s.truth.text, s.layout.name, s.shot, s.spec.seed, err));
    fs_log_progress(log, "synth", s.n, s.n, "");
    fs_log_info(log, "synth: %d photos in %s/capture/raw and jpeg, ground truth in %s", s.spec.photos, out,
                s.truth.text);
fail:
    fs_lock_release(&s.lock);
    fs_threads_free(s.threads);
    fs_layout_free(&s.layout);
    fs_nuisance_free(&s.nuisance);
    free(s.shot);
    return rc;
}

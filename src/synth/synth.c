// The order of things: scene, baked light, path, balance, then view by view the layers, the photo, its files, the
// truth.
#include "synth/synth.h"

#include <stdlib.h>

#include "base/file.h"
#include "base/owned.h"
#include "synth/photo_file.h"
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
    const Log *log;
} Synth;

static int prepare(Synth *s, FsError *err)
{
    MUST(fs_layout_build(&s->layout, &s->spec, err));
    fs_log_info(s->log, "synth: seed %u is a %s, mirroring a %s; %d and %d shapes", s->spec.seed, s->layout.name,
                s->layout.room_name, s->layout.behind.n, s->layout.room.n);
    MUST(fs_bake_ambient(&s->layout.behind, s->threads, err));
    MUST(fs_bake_ambient(&s->layout.room, s->threads, err));
    MUST(fs_path_plan(&s->layout, &s->spec, &s->shot, err));
    s->n = s->spec.photos + s->spec.held_out;
    return fs_trace_balance(&s->layout, &s->spec, s->shot, s->threads, &s->lighting, err);
}

// An earlier capture in the same folder is replaced, anything else there is left alone.
static int make_folders(const Synth *s, FsError *err)
{
    static const char *const folders[] = {"capture", "truth", "capture/raw", "capture/jpeg"};
    for (int i = 0; i < 2; i++) MUST(fs_owned_check_tree(fs_file_at("%s/%s", s->out, folders[i]).text, err));
    for (int i = 0; i < 2; i++) MUST(fs_owned_open(fs_file_at("%s/%s", s->out, folders[i]).text, "capture", err));
    for (int i = 0; i < 2; i++) fs_owned_remove(fs_file_at("%s/%s/.", s->out, folders[i]).text);
    for (int i = 0; i < 4; i++) MUST(fs_file_mkdirs(fs_file_at("%s/%s", s->out, folders[i]).text, err));
    return fs_truth_files_cameras(s->truth.text, s->layout.name, s->shot, s->n, &s->spec, err);
}

// Exposes a view's light and writes it as a RAW and a JPEG file.
static int write_photo(const Synth *s, int number, const Image *light, FsError *err)
{
    const Shot *shot = &s->shot[number];
    int rc;
    Mosaic mosaic = {0};
    Image picture = {0};
    int side = s->spec.width > s->spec.height ? s->spec.width : s->spec.height;
    ShotInfo info = {shot->flash,    number + 1, s->spec.width,
                     s->spec.height, 23.9,       (int)(36.0 * shot->camera.fx / side + 0.5)};
    unsigned char exif[FS_PHOTO_FILE_EXIF];
    TRY(fs_sensor_expose(light, fs_rng_new(s->spec.seed * 100003ull + (unsigned)number), &mosaic, err));
    TRY(fs_dng_write(fs_file_at("%s/capture/raw/%s.DNG", s->out, shot->name).text, &mosaic, &info, err));
    TRY(fs_sensor_develop(&mosaic, &picture, err));
    TRY(fs_jpeg_write(fs_file_at("%s/capture/jpeg/%s.JPG", s->out, shot->name).text, &picture, 95, exif,
                      fs_photo_file_exif(&info, exif), err));
fail:
    fs_sensor_mosaic_free(&mosaic);
    fs_image_free(&picture);
    return rc;
}

static int make_view(const Synth *s, int number, FsError *err)
{
    const Shot *shot = &s->shot[number];
    TraceLayer t = shot->flash ? TRACE_T_F : TRACE_T_N, r = shot->flash ? TRACE_R_F : TRACE_R_N;
    unsigned want = shot->truth ? (1u << TRACE_LAYERS) - 1 : 1u << t | 1u << r;
    Traced traced;
    Image depth = {0}, beta = {0};
    int rc = fs_trace_view(&s->layout, &s->spec, &s->lighting, (TraceRequest){&shot->camera, want, number}, s->threads,
                           &traced, err);
    if (rc < 0) return rc;
    if (shot->truth) TRY(fs_truth_files_layers(s->truth.text, shot, &traced, err));
    if (shot->held_out) {
        TRY(fs_trace_geometry(&s->layout, &s->lighting, &shot->camera, s->threads, &depth, &beta, err));
        TRY(fs_truth_files_geometry(s->truth.text, shot, &depth, &beta, err));
    } else {
        Image *light = &traced.layer[t];
        for (size_t i = 0; i < fs_image_values(light); i++) light->px[i] += traced.layer[r].px[i];
        TRY(write_photo(s, number, light, err));
    }
fail:
    fs_trace_free(&traced);
    fs_image_free(&depth);
    fs_image_free(&beta);
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
    TRY(make_folders(&s, err));
    for (int i = 0; i < s.n; i++) {
        fs_log_progress(log, "synth", i, s.n, s.shot[i].name);
        if (fs_log_cancelled(log))
            TRY(fs_error_set(err, FS_ERR_CANCELLED, "%s: stopped after %d of %d views", out, i, s.n));
        TRY(make_view(&s, i, err));
    }
    fs_log_progress(log, "synth", s.n, s.n, "");
    fs_log_info(log, "synth: %d photos in %s/capture/raw and jpeg, ground truth in %s", s.spec.photos, out,
                s.truth.text);
fail:
    fs_threads_free(s.threads);
    fs_layout_free(&s.layout);
    free(s.shot);
    return rc;
}

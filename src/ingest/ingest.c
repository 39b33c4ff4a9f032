// The stage: scan, sort by flash, level, develop, write down.
#include "ingest/ingest.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/json_file.h"
#include "base/owned.h"
#include "image/raw.h"
#include "ingest/develop.h"
#include "ingest/photo_mask.h"
#include "model/findings.h"
#include "model/originals.h"

typedef struct Work {
    const FsProject *project;
    Photos *photos;
    const char *dir;
    atomic_int done;
    atomic_bool cancelled;
} Work;

static void develop_one(void *context, int i, int worker)
{
    Work *work = context;
    const Log *log = &work->project->log;
    if (worker == 0) { // the caller's own thread
        fs_log_progress(log, "ingest", work->done, work->photos->n, work->photos->photo[i].file);
        if (fs_log_cancelled(log)) work->cancelled = true;
    }
    if (work->cancelled) return;
    fs_develop_photo(work->photos, &work->photos->photo[i], work->dir, work->project->set.long_edge);
    work->done++;
}

// Photos at once: no more than fit in some memory.
static int at_once(const Photos *photos, int long_edge, int threads, double *largest)
{
    *largest = 0;
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        *largest = fmax(*largest, photo->memory + fs_develop_bytes(photo, long_edge));
    }
    return (int)fmax(1, fmin(threads, FS_PHOTOS_AT_ONCE / *largest));
}

static int develop_all(const FsProject *project, Photos *photos, const char *dir, const Threads *all, FsError *err)
{
    Work work = {.project = project, .photos = photos, .dir = dir};
    double largest;
    Threads *threads = fs_threads_new(at_once(photos, project->set.long_edge, fs_threads_count(all), &largest));
    if (!threads) return fs_error_memory(err);
    fs_threads_for(threads, photos->n, develop_one, &work);
    fs_threads_free(threads);
    if (work.cancelled || fs_log_cancelled(&project->log))
        return fs_error_set(err, FS_ERR_CANCELLED, "ingest: cancelled after %d of %d photos", work.done, photos->n);
    fs_log_progress(&project->log, "ingest", photos->n, photos->n, "");
    return 0;
}

// With what was made of them.
static void drop_copies(Photos *photos, const char *dir)
{
    for (int i = 0; i < photos->n; i++) {
        const char *name = photos->photo[i].name;
        if (!fs_photos_is_copy(photos, &photos->photo[i])) continue;
        fs_owned_remove(fs_file_at("%s/%s.tif", dir, name).text);
        fs_owned_remove(fs_file_at("%s/%s_mask.png", dir, name).text);
        fs_owned_remove(fs_file_at("%s/features/%s.png", dir, name).text);
        fs_owned_remove(fs_file_at("%s/features_masks/%s.png.png", dir, name).text);
        fs_owned_remove(fs_file_at("%s/fine/%s.tif", dir, name).text);
        fs_owned_remove(fs_file_at("%s/fine/%s_mask.png", dir, name).text);
    }
    fs_photos_drop_copies(photos);
}

// What the pictures themselves give away.
static void check_pictures(const Photos *photos, const Log *log)
{
    double mean[2] = {0};
    int count[2] = {0}, encoded = 0, sizes = 0;
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        mean[photo->flash] += photo->mean;
        count[photo->flash]++;
        encoded += photo->encoded;
        sizes += photo->width != photos->photo[0].width || photo->height != photos->photo[0].height;
    }
    double off = count[0] ? mean[0] / count[0] : 0, on = count[1] ? mean[1] / count[1] : off;
    if (encoded)
        fs_log_warn(log,
                    "%d photos are not linear (JPEG or 8 bits): linearised by their profile or the sRGB curve, reduced "
                    "quality; RAW "
                    "files separate better",
                    encoded);
    if (sizes)
        fs_log_warn(log, "%d photos have another size than %s (%d x %d): use one camera, one zoom and one orientation",
                    sizes, photos->photo[0].file, photos->photo[0].width, photos->photo[0].height);
    if (count[0] && count[1] && on < 1.02 * off)
        fs_log_warn(log,
                    "the flash photos are no brighter (mean %.4f) than the others (%.4f): is the flash state right, "
                    "and does the flash reach the scene?",
                    on, off);
}

// What `check` says, as far as the warnings above do not.
static int warn_of_findings(Photos *photos, const Log *log, FsError *err)
{
    static const char *const kinds[] = {"misfire", "wrong-flash", "gap",   "blur", "zoom", "clipped",
                                        "dark",    "untold",      "copy",  "both", "twin", "stranger",
                                        "body",    "few",         "focus", "lens", "grey", "profile"};
    Findings findings;
    MUST(fs_findings_make(&findings, photos, err));
    for (int i = 0; i < findings.n; i++)
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
            if (strcmp(findings.finding[i].kind, kinds[k]) == 0) fs_log_warn(log, "%s", findings.finding[i].text);
    fs_findings_free(&findings);
    return 0;
}

static json_t *photo_json(const PhotoFile *photo)
{
    double focal =
        fs_exif_focal_px(&photo->exif, photo->orig_width, photo->orig_height) * photo->width / photo->orig_width;
    return json_pack("{s:s, s:s, s:b, s:i, s:i, s:i, s:i, s:i, s:f, s:f, s:f, s:f, s:f, s:s, s:f, s:f, s:f, s:f, s:f}",
                     "name", photo->name, "file", photo->file, "flash", photo->flash, "width", photo->width, "height",
                     photo->height, "orig_width", photo->orig_width, "orig_height", photo->orig_height, "orientation",
                     photo->exif.orientation, "exposure_s", photo->exif.exposure_s, "iso", photo->exif.iso, "f_number",
                     photo->exif.f_number, "focal_px", focal, "focal_mm", photo->exif.focal_mm, "quality",
                     photo->encoded  ? "reduced"
                     : photo->untold ? "untold"
                                     : "raw",
                     "clipped_fraction", photo->clipped, "exposure_gain", photo->gain, "flash_gain", photo->flash_gain,
                     "brightness", photo->brightness, "sharpness", photo->sharpness);
}

// What the camera's colours mean, for pictures that people look at: of the first RAW photo that knows.
static void put_matrix(json_t *root, const Photos *photos)
{
    for (int i = 0; i < photos->n; i++) {
        RawInfo info = {0};
        FilePath path = fs_photos_path(photos, &photos->photo[i]);
        bool known = photos->photo[i].kind == PHOTO_RAW && fs_raw_read_info(path.text, &info, NULL) == 0;
        if (!known || info.srgb_from_camera[0] == 0) continue;
        json_t *matrix = json_array();
        for (int k = 0; k < 9; k++) json_array_append_new(matrix, json_real(info.srgb_from_camera[k]));
        json_object_set_new(root, "srgb_from_camera", matrix);
        return;
    }
}

static int write_json(const FsProject *project, const Photos *photos, FsError *err)
{
    const double *wb = photos->white_balance;
    json_t *list = json_array();
    for (int i = 0; list && i < photos->n; i++)
        if (json_array_append_new(list, photo_json(&photos->photo[i])) != 0) {
            json_decref(list);
            list = NULL;
        }
    json_t *root = list ? json_pack("{s:i, s:[f,f,f], s:o}", "long_edge", project->set.long_edge, "white_balance",
                                    wb[0], wb[1], wb[2], "photos", list)
                        : NULL;
    if (root) put_matrix(root, photos);
    FilePath path = fs_file_at("%s/ingest.json", project->out);
    return fs_json_file_write(path.text, root, JSON_INDENT(1) | JSON_REAL_PRECISION(9), err);
}

static int make_folders(const char *dir, FsError *err)
{
    MUST(fs_file_mkdirs(fs_file_at("%s/features", dir).text, err));
    return fs_file_mkdirs(fs_file_at("%s/fine", dir).text, err);
}

// Nothing has been touched so far.
static int begin(FsProject *project, const Photos *photos, const char *dir, FsError *err)
{
    const char **name = calloc((size_t)photos->n, sizeof *name);
    int rc = name ? fs_project_check_input(project, photos->folder, err) : fs_error_memory(err);
    for (int i = 0; i < photos->n && rc == 0; i++) name[i] = photos->photo[i].name;
    if (rc == 0 && *project->set.flash_list) rc = fs_project_check_input(project, project->set.flash_list, err);
    if (rc == 0 && *project->set.masks) rc = fs_project_check_input(project, project->set.masks, err);
    if (rc == 0) rc = fs_project_begin(project, FS_STAGE_INGEST, name, photos->n, err);
    if (rc == 0) rc = make_folders(dir, err);
    if (rc == 0 && *project->set.masks) rc = fs_file_mkdirs(fs_file_at("%s/features_masks", dir).text, err);
    free(name);
    return rc;
}

bool fs_ingest_look(FsProject *project, const char *folder)
{
    Photos photos;
    *project->photos = 0;
    if (fs_photos_scan(&photos, folder, &(Log){0}, NULL) == 0) {
        photos.masks = project->set.masks;
        fs_photos_fingerprint(&photos, project->set.flash_list, project->photos);
        fs_photos_free(&photos);
    } else if (fs_file_exists(folder)) {
        return false;
    }
    return true;
}

// Where the photos are now; of a folder that is only looked at any more, as read-only ones are, it need not be known.
static int remember_again(const FsProject *project, const char *folder, FsError *err)
{
    FsError why = {0};
    int rc = fs_file_exists(folder) ? fs_originals_remember(project, folder, &why) : 0;
    if (rc == FS_ERR_INPUT) {
        fs_log_warn(&project->log, "%s; `export --clean` needs --originals DIR", why.message);
        return 0;
    }
    if (rc == FS_ERR_IO && fs_project_is_read_only(project)) return 0; // they are known by their old place
    if (rc < 0 && err) *err = why;
    return rc;
}

static int level(const FsProject *project, Photos *photos, FsError *err)
{
    MUST(fs_photos_find_flash(photos, project, err));
    MUST(fs_level_photos(photos, &project->log, err));
    return fs_photo_mask_check(photos, &project->log, err);
}

int fs_ingest_run(FsProject *project, const char *folder, FsError *err)
{
    MUST(fs_originals_check(project, folder, err));
    if (fs_ingest_look(project, folder) && fs_project_done(project, FS_STAGE_INGEST))
        return remember_again(project, folder, err);
    int rc = 0;
    const Log *log = &project->log;
    Photos photos = {0};
    FilePath dir = fs_file_at("%s/linear", project->out);
    Threads *threads = fs_threads_new(project->set.threads);
    if (!threads) TRY(fs_error_memory(err));
    TRY(fs_photos_scan(&photos, folder, log, err));
    photos.masks = project->set.masks;
    TRY(fs_photos_levels(&photos.npy, &project->set, err));
    fs_photos_read_headers(&photos, threads);
    if (fs_photos_take_jpegs(&photos, log)) fs_photos_read_headers(&photos, threads);
    TRY(level(project, &photos, err));
    TRY(begin(project, &photos, dir.text, err));
    TRY(develop_all(project, &photos, dir.text, threads, err));
    if (fs_photos_take_jpegs(&photos, log)) {
        fs_photos_read_headers(&photos, threads);
        TRY(level(project, &photos, err));
        TRY(develop_all(project, &photos, dir.text, threads, err));
    }
    TRY(fs_photos_drop_failed(&photos, log, err));
    drop_copies(&photos, dir.text);
    TRY(fs_photos_check_groups(&photos, project, err));
    check_pictures(&photos, log);
    TRY(warn_of_findings(&photos, log, err));
    TRY(write_json(project, &photos, err));
    TRY(fs_originals_remember(project, folder, err));
    TRY(fs_project_mark_done(project, FS_STAGE_INGEST, err));
fail:
    fs_threads_free(threads);
    fs_photos_free(&photos);
    return rc;
}

// The middle photo that can be read, and how long it takes.
static int develop_some(Photos *photos, const char *dir, int long_edge, const PhotoFile **some, double *seconds,
                        FsError *err)
{
    for (int k = 0; k < photos->n; k++) {
        PhotoFile *photo = &photos->photo[(photos->n / 2 + k) % photos->n];
        if (photo->failure.code) continue;
        double begin = fs_clock_seconds();
        fs_develop_photo(photos, photo, dir, long_edge);
        *seconds = fs_clock_seconds() - begin;
        *some = photo;
        if (photo->failure.code != FS_ERR_INPUT)
            return photo->failure.code ? fs_error_set(err, photo->failure.code, "%s", photo->failure.message) : 0;
    }
    return fs_error_input(err, "%s: no photo in it can be read", photos->folder);
}

int fs_ingest_estimate(const FsProject *project, const char *folder, RunSize *size, RunCost *cost, FsError *err)
{
    int rc;
    Photos photos = {0};
    Threads *threads = fs_threads_new(project->set.threads);
    FilePath dir = fs_file_at("%s/" FS_OWNED_DIR "/estimate", project->out);
    if (!threads) TRY(fs_error_memory(err));
    TRY(fs_photos_scan(&photos, folder, &(Log){0}, err));
    TRY(fs_photos_levels(&photos.npy, &project->set, err));
    fs_photos_read_headers(&photos, threads);
    const PhotoFile *photo = NULL;
    double seconds = 0, largest;
    TRY(make_folders(dir.text, err));
    rc = develop_some(&photos, dir.text, project->set.long_edge, &photo, &seconds, err);
    if (rc == FS_ERR_INPUT && fs_photos_take_jpegs(&photos, &(Log){0})) {
        fs_photos_read_headers(&photos, threads);
        rc = develop_some(&photos, dir.text, project->set.long_edge, &photo, &seconds, err);
    }
    TRY(rc);
    int n = at_once(&photos, project->set.long_edge, fs_threads_count(threads), &largest);
    int width = photo->orig_width, height = photo->orig_height;
    fs_image_limit(FS_DEVELOP_FEATURES_EDGE, &width, &height);
    *size = (RunSize){photos.n, photo->width, photo->height, (double)width * height};
    *cost = (RunCost){seconds * ceil((double)photos.n / n), 30e6 + n * largest};
fail:
    fs_owned_remove(dir.text);
    fs_photos_free(&photos);
    fs_threads_free(threads);
    return rc;
}

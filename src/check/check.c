#include "check/check.h"

#include <math.h>
#include <stdatomic.h>

#include "base/file.h"
#include "base/json_file.h"
#include "model/findings.h"

typedef struct Work {
    Photos *photos;
    const Log *log;
    atomic_int done;
    atomic_bool cancelled;
} Work;

static int look_at(const Photos *photos, PhotoFile *photo, FsError *err)
{
    SensorLevels levels = photos->npy;
    for (int c = 0; c < 3; c++) levels.gain[c] = photo->white_balance[1] > 0 ? photo->white_balance[c] : 1;
    PhotoSizes sizes = {.n = 1, .size = {{.long_edge = FS_LOOK_EDGE}}, .enough = FS_LOOK_EDGE};
    Image *rgb = &sizes.size[0].rgb, *clipped = &sizes.size[0].clipped;
    PhotoLight light;
    int rc;
    TRY(fs_photo_read(fs_photos_path(photos, photo).text, &levels, &sizes, &light, err));
    TRY(fs_image_orient(rgb, photo->exif.orientation, err));
    fs_look_free(&photo->look);
    TRY(fs_look_at(&photo->look, rgb, err));
    for (size_t i = 0; i < fs_image_pixels(clipped); i++)
        photo->look.clipped += (double)clipped->px[i] / (double)fs_image_pixels(clipped);
    photo->look_gain = 1;
    photo->encoded = light >= PHOTO_ENCODED;
    photo->untold = light == PHOTO_UNTOLD;
    photo->unread = light == PHOTO_UNREAD;
fail:
    fs_sizes_free(&sizes);
    return rc;
}

static void look_at_one(void *context, int i, int worker)
{
    Work *work = context;
    PhotoFile *photo = &work->photos->photo[i];
    if (worker == 0) { // the caller's own thread
        fs_log_progress(work->log, "check", work->done, work->photos->n, photo->file);
        if (fs_log_cancelled(work->log)) work->cancelled = true;
    }
    if (!work->cancelled && !photo->failure.code) look_at(work->photos, photo, &photo->failure);
    work->done++;
}

static int look_at_all(Photos *photos, int wanted, const Log *log, FsError *err)
{
    double largest = 1;
    Threads *threads = fs_threads_new(wanted);
    if (!threads) return fs_error_memory(err);
    fs_photos_read_headers(photos, threads);
    if (fs_photos_take_jpegs(photos, log)) fs_photos_read_headers(photos, threads);
    for (int i = 0; i < photos->n; i++) largest = fmax(largest, photos->photo[i].memory);
    int n = (int)fmax(1, fmin(fs_threads_count(threads), FS_PHOTOS_AT_ONCE / largest));
    fs_threads_free(threads);
    threads = fs_threads_new(n);
    if (!threads) return fs_error_memory(err);
    Work work = {.photos = photos, .log = log};
    fs_threads_for(threads, photos->n, look_at_one, &work);
    fs_threads_free(threads);
    if (work.cancelled) return fs_error_set(err, FS_ERR_CANCELLED, "check: cancelled");
    fs_log_progress(log, "check", photos->n, photos->n, "");
    return 0;
}

// ---- what is said ----

static void say_photo(const Photos *photos, const PhotoFile *photo, const Log *log)
{
    const ExifInfo *e = &photo->exif;
    char exposure[120], focal[32] = "", balance[40] = "", beside[120] = "";
    fs_exif_exposure_text(e, exposure);
    if (e->focal_mm > 0) snprintf(focal, sizeof focal, ", %.4g mm", e->focal_mm);
    if (e->white != WHITE_UNKNOWN)
        snprintf(balance, sizeof balance, ", white balance %s", e->white == WHITE_AUTO ? "automatic" : "by hand");
    if (photo->white_balance[0] > 0)
        snprintf(balance, sizeof balance, ", white %.2f 1 %.2f", photo->white_balance[0], photo->white_balance[2]);
    if (photo->beside >= 0) snprintf(beside, sizeof beside, ", beside %.90s", photos->photo[photo->beside].file);
    fs_log_info(log, "%-16s %-8s %s%s%s, sharp %.0f %%, clipped %.1f %%%s", photo->file,
                photo->flash ? "flash" : "no flash", exposure, focal, balance, 100 * fmin(photo->sharpness, 9.99),
                100 * photo->look.clipped, beside);
}

static const char *const weights[] = {"hint", "doubt", "unusable"};
static const char *const verdicts[] = {"good", "doubts", "unusable"};

static json_t *photo_json(const PhotoFile *photo)
{
    const ExifInfo *e = &photo->exif;
    static const char *const white[] = {
        [WHITE_UNKNOWN] = NULL, [WHITE_AUTO] = "automatic", [WHITE_BY_HAND] = "by hand"};
    return json_pack("{s:s, s:s, s:s?, s:b, s:f, s:f, s:f, s:f, s:[f,f,f], s:i, s:i, s:f, s:f, s:f, s:b}", "name",
                     photo->name, "file", photo->file, "white_balance_set", white[e->white], "flash", photo->flash == 1,
                     "exposure_s", e->exposure_s, "iso", e->iso, "f_number", e->f_number, "focal_mm", e->focal_mm,
                     "white_balance", photo->white_balance[0], photo->white_balance[1], photo->white_balance[2],
                     "width", e->width, "height", e->height, "sharpness", photo->sharpness, "clipped",
                     photo->look.clipped, "mean", photo->look.mean, "raw", photo->kind <= PHOTO_NPY);
}

static int write_json(const char *path, const Photos *photos, const Findings *findings, FsError *err)
{
    json_t *list = json_array(), *found = json_array();
    for (int i = 0; i < photos->n; i++) {
        json_t *photo = photo_json(&photos->photo[i]);
        int beside = photos->photo[i].beside, twin = photos->photo[i].twin_of;
        json_object_set_new(photo, "beside", beside < 0 ? json_null() : json_string(photos->photo[beside].name));
        json_object_set_new(photo, "twin_of", twin < 0 ? json_null() : json_string(photos->photo[twin].name));
        json_object_set_new(photo, "stranger", json_boolean(photos->photo[i].stranger));
        json_array_append_new(list, photo);
    }
    for (int i = 0; i < findings->n; i++) {
        const Finding *finding = &findings->finding[i];
        char *text = fs_photos_utf8(finding->text); // with names of files
        if (!text) fs_error_memory(NULL);
        json_array_append_new(found, json_pack("{s:s, s:s, s:s}", "kind", finding->kind, "weight",
                                               weights[finding->weight], "text", text ? text : ""));
        free(text);
    }
    json_t *adds = isfinite(findings->flash_adds) ? json_real(findings->flash_adds) : json_null();
    return fs_json_file_write(path,
                              json_pack("{s:s, s:o, s:o, s:o}", "verdict", verdicts[fs_findings_worst(findings)],
                                        "flash_adds", adds, "findings", found, "photos", list),
                              JSON_INDENT(1) | JSON_REAL_PRECISION(6), err);
}

static int say(const Photos *photos, const Findings *findings, const Log *log, FsError *err)
{
    int flash = 0, raws = 0;
    FindingWeight worst = fs_findings_worst(findings);
    const char *reason = "";
    for (int i = 0; i < photos->n; i++) {
        say_photo(photos, &photos->photo[i], log);
        flash += photos->photo[i].flash == 1;
        raws += photos->photo[i].kind <= PHOTO_NPY;
    }
    fs_log_info(log, "%d photos: %d with flash, %d without, %d RAW", photos->n, flash, photos->n - flash, raws);
    if (isfinite(findings->flash_adds)) fs_log_info(log, "the flash adds %.0f %% of light", 100 * findings->flash_adds);
    for (int i = 0; i < findings->n; i++) {
        const Finding *finding = &findings->finding[i];
        fs_log_info(log, "- %s", finding->text);
        if (finding->weight == FINDING_UNUSABLE) reason = finding->text;
    }
    if (worst == FINDING_UNUSABLE) return fs_error_input(err, "%s: not usable: %s", photos->folder, reason);
    fs_log_info(log, worst == FINDING_DOUBT ? "usable with doubts" : "good");
    return worst == FINDING_DOUBT ? FS_DOUBTS : 0;
}

int fs_check_run(const char *folder, const FsSettings *settings, const Log *log, FsError *err)
{
    Photos photos = {0};
    Findings findings = {0};
    int rc;
    if (*settings->json) MUST(fs_json_file_check(settings->json, "verdict", err));
    if (*settings->flash_list && !fs_file_exists(settings->flash_list))
        return fs_error_input(err, "%s: no such file, or it cannot be read; --flash-list names it",
                              settings->flash_list);
    TRY(fs_photos_scan(&photos, folder, log, err));
    TRY(fs_photos_levels(&photos.npy, settings, err));
    TRY(look_at_all(&photos, settings->threads, log, err));
    if (fs_photos_take_jpegs(&photos, log)) TRY(look_at_all(&photos, settings->threads, log, err));
    TRY(fs_photos_mark_flash(&photos, settings, log, err));
    TRY(fs_photos_drop_failed(&photos, log, err));
    fs_photos_drop_copies(&photos);
    TRY(fs_findings_make(&findings, &photos, err));
    rc = say(&photos, &findings, log, err);
    if (*settings->json) {
        FsError unwritten = {0};
        if (write_json(settings->json, &photos, &findings, &unwritten) < 0)
            rc = fs_error_set(err, unwritten.code, "%s", unwritten.message);
    }
fail:
    fs_findings_free(&findings);
    fs_photos_free(&photos);
    return rc;
}

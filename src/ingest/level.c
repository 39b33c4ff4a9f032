// One white balance and one exposure for the whole capture: the sum of layers holds only when all photos share them.
#include <math.h>
#include <stdlib.h>

#include "ingest/develop.h"

static void level_white_balance(Photos *photos, double *value, const Log *log)
{
    const PhotoFile *odd = NULL;
    int raws = 0;
    for (int i = 0; i < photos->n; i++) raws += photos->photo[i].kind <= PHOTO_NPY;
    if (raws == 0) return;
    if (raws < photos->n)
        fs_log_warn(
            log,
            "%d photos are RAW (or .npy) and %d are not: their colours and brightness cannot be matched well; use one "
            "kind only",
            raws, photos->n - raws);
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < photos->n; i++) value[i] = photos->photo[i].white_balance[c];
        double m = fs_photos_median(value, photos->n);
        photos->white_balance[c] = m > 0 ? m : 1;
        for (int i = 0; i < photos->n; i++)
            if (value[i] > 0 && fabs(value[i] / photos->white_balance[c] - 1) > 0.03) odd = &photos->photo[i];
    }
    const double *wb = photos->white_balance;
    if (odd)
        fs_log_warn(log,
                    "white balance as shot differs between photos (%s: %.3f 1 %.3f); all are developed with the "
                    "median, %.3f 1 %.3f",
                    odd->file, odd->white_balance[0], odd->white_balance[2], wb[0], wb[2]);
    else
        fs_log_info(log, "white balance %.3f %.4g %.3f", wb[0], wb[1], wb[2]);
}

static void level_exposure(Photos *photos, double *value, const Log *log)
{
    fs_photos_exposures(photos, value);
    double m = fs_photos_median(value, photos->n);
    int unknown = 0, differ = 0;
    const PhotoFile *odd = NULL;
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        unknown += value[i] == 0;
        if (m == 0 || value[i] == 0 || fabs(value[i] / m - 1) < 0.01) continue;
        photo->gain = m / value[i];
        differ++;
        odd = photo;
    }
    char exposure[120] = "";
    if (odd) fs_exif_exposure_text(&odd->exif, exposure);
    if (differ)
        fs_log_warn(log,
                    "%d of %d photos have another shutter time, ISO or aperture (e.g. %s: %s); they are brought to the "
                    "median exposure",
                    differ, photos->n, odd->file, exposure);
    if (unknown == photos->n)
        fs_log_warn(log, "the photos do not tell their exposure: taken to be the same for all");
    else if (unknown)
        fs_log_warn(log, "%d of %d photos do not tell their exposure: taken to be the median", unknown, photos->n);
}

// value: as level_exposure left them. The shutter scales the room's light and not the flash's: of two photos of one
// exposure, the one of half the shutter time has twice the flash.
static void level_flash(Photos *photos, double *value, const Log *log)
{
    int differ = 0, flash = 0;
    const PhotoFile *odd = NULL;
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        value[i] = photo->flash == 1 && value[i] > 0 ? photo->gain * value[i] / photo->exif.exposure_s : 0;
        flash += photo->flash == 1;
    }
    double m = fs_photos_median(value, photos->n);
    for (int i = 0; i < photos->n; i++) {
        if (m == 0 || value[i] == 0) continue;
        photos->photo[i].flash_gain = value[i] / m;
        if (fabs(value[i] / m - 1) < 0.02) continue;
        differ++;
        odd = &photos->photo[i];
    }
    if (!differ) return;
    char exposure[120];
    fs_exif_exposure_text(&odd->exif, exposure);
    fs_log_warn(
        log,
        "%d of %d flash photos have another shutter time, which the flash's light does not follow (e.g. %s: %s: "
        "%.2g times as much of it as the others): use one manual exposure",
        differ, flash, odd->file, exposure, odd->flash_gain);
}

int fs_level_photos(Photos *photos, const Log *log, FsError *err)
{
    double *value = calloc((size_t)photos->n + 1, sizeof *value);
    if (!value) return fs_error_memory(err);
    for (int i = 0; i < photos->n; i++) photos->photo[i].gain = photos->photo[i].flash_gain = 1; // of a former round
    level_white_balance(photos, value, log);
    level_exposure(photos, value, log);
    level_flash(photos, value, log);
    free(value);
    return 0;
}

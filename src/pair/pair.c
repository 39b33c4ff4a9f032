// Reads both photos in one white balance, brings the no-flash photo to the other's exposure, and subtracts.
#include "pair/pair.h"

#include <math.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"
#include "image/tone.h"
#include "model/photos.h"

typedef struct PairPhoto {
    const char *path;
    ExifInfo exif;
    double white_balance[3]; // as shot; 0 unknown
    PhotoLight light;
    int width, height;  // upright, as shot
    Image rgb, clipped; // upright, at the working size
} PairPhoto;

static int read_photo(PairPhoto *photo, const SensorLevels *levels, int long_edge, FsError *err)
{
    PhotoSizes sizes = {.n = 1, .size = {{.long_edge = long_edge}}};
    MUST(fs_photo_read(photo->path, levels, &sizes, &photo->light, err));
    bool turned = photo->exif.orientation > 4;
    photo->rgb = sizes.size[0].rgb;
    photo->clipped = sizes.size[0].clipped;
    photo->width = turned ? sizes.height : sizes.width;
    photo->height = turned ? sizes.width : sizes.height;
    MUST(fs_image_orient(&photo->rgb, photo->exif.orientation, err));
    return fs_image_orient(&photo->clipped, photo->exif.orientation, err);
}

// On a tripod both are the same way up, whatever the camera's sensor made of looking steeply up or down.
static void turn_alike(const PairPhoto *flash, PairPhoto *noflash, const Log *log)
{
    const ExifInfo *f = &flash->exif, *n = &noflash->exif;
    if (f->orientation == n->orientation || f->width != n->width || f->height != n->height) return;
    fs_log_warn(log, "%s: its EXIF says that it is to be turned otherwise than %s: both are turned as that one",
                noflash->path, flash->path);
    noflash->exif.orientation = f->orientation;
}

static void warn_flash(const PairPhoto *flash, const PairPhoto *noflash, const Log *log)
{
    if (fs_exif_flash_fired(&flash->exif) == 0)
        fs_log_warn(log, "%s: its EXIF says that the flash did not fire: the flash photo comes first", flash->path);
    if (fs_exif_flash_fired(&noflash->exif) == 1)
        fs_log_warn(log, "%s: its EXIF says that the flash fired: the no-flash photo comes second", noflash->path);
    if (flash->light >= PHOTO_ENCODED || noflash->light >= PHOTO_ENCODED)
        fs_log_warn(log,
                    "not RAW: linear light is only guessed from display values, the difference is of reduced quality");
}

// The flash photo's, so that its colours are those the camera meant; known is false for other than RAW.
static void common_white_balance(const PairPhoto *flash, const PairPhoto *noflash, double white_balance[3],
                                 const Log *log)
{
    const PairPhoto *from = flash->white_balance[0] > 0 ? flash : noflash;
    bool differs = false;
    for (int c = 0; c < 3; c++) {
        white_balance[c] = from->white_balance[c] > 0 ? from->white_balance[c] : 1;
        double a = flash->white_balance[c], b = noflash->white_balance[c];
        differs |= a > 0 && b > 0 && fabs(a / b - 1) > 0.03;
    }
    if (differs) fs_log_warn(log, "the photos' white balances differ; both are developed with that of %s", from->path);
    if ((flash->white_balance[0] > 0) != (noflash->white_balance[0] > 0))
        fs_log_warn(log, "one photo is RAW and one is not: their colours and brightness cannot be matched well");
}

// What the no-flash photo is multiplied with to have the flash photo's exposure.
static double exposure_ratio(const PairPhoto *flash, const PairPhoto *noflash, const Log *log)
{
    const ExifInfo *f = &flash->exif, *n = &noflash->exif;
    double a = fs_exif_exposure(f), b = fs_exif_exposure(n);
    if (!(a > 0) || !(b > 0) || (f->f_number > 0) != (n->f_number > 0) || (f->iso > 0) != (n->iso > 0)) {
        fs_log_warn(log, "the photos do not both tell their exposure: taken to be the same");
        return 1;
    }
    if (fabs(a / b - 1) < 0.01) return 1;
    char lit[120], unlit[120];
    fs_exif_exposure_text(f, lit);
    fs_exif_exposure_text(n, unlit);
    fs_log_warn(log, "exposures differ (%s with flash; %s without): the no-flash photo is multiplied by %.4g", lit,
                unlit, a / b);
    return a / b;
}

// flash->rgb becomes the difference.
static void subtract(PairPhoto *flash, const PairPhoto *noflash, double ratio, const Log *log)
{
    size_t pixels = fs_image_pixels(&flash->rgb);
    double ambient = 0, added = 0, lost = 0;
    for (size_t i = 0; i < pixels; i++) {
        lost += flash->clipped.px[i] > 1e-4f || noflash->clipped.px[i] > 1e-4f;
        for (size_t c = 0; c < 3; c++) {
            float n = (float)(noflash->rgb.px[3 * i + c] * ratio), d = flash->rgb.px[3 * i + c] - n;
            flash->rgb.px[3 * i + c] = d;
            ambient += n;
            added += d;
        }
    }
    double gain = ambient > 0 ? added / ambient : 0;
    fs_log_info(log,
                "pair: the flash added %.3g times the light of the no-flash photo; %.2f %% of the pixels are clipped "
                "in one of the two",
                gain, 100 * lost / (double)pixels);
    if (gain < 0.05)
        fs_log_warn(
            log,
            "the flash photo is hardly brighter: the difference is mostly noise (photos swapped, or a weak flash)");
}

static int write_difference(Image *difference, const char *out, const char *tiff, const Log *log, FsError *err)
{
    if (tiff) {
        MUST(fs_tiff_write_float(tiff, difference, err));
        fs_owned_sign(tiff, "pair");
        fs_log_info(log, "pair: %s, linear", tiff);
    }
    fs_tone_encode_image(difference);
    MUST(fs_png_write(out, difference, 8, err));
    fs_owned_sign(out, "pair");
    fs_log_info(log, "pair: %s, %d x %d", out, difference->width, difference->height);
    return 0;
}

int fs_pair_run(const char *flash_path, const char *noflash_path, const char *out, const FsSettings *settings,
                const Log *log, FsError *err)
{
    PairPhoto flash = {.path = flash_path}, noflash = {.path = noflash_path};
    SensorLevels levels;
    int rc;
    if (!fs_file_has_ext(out, "png"))
        return fs_error_set(err, FS_ERR_USAGE, "%s: the difference is written as PNG: give a name that ends in .png",
                            out);
    FilePath tiff = fs_file_at("%.*s.tif", (int)(strlen(out) - 4), out);
    TRY(fs_owned_check_single(out, "pair", err));
    if (settings->linear) TRY(fs_owned_check_single(tiff.text, "pair", err));
    TRY(fs_photos_levels(&levels, settings, err));
    TRY(fs_photo_read_info(flash.path, &flash.exif, flash.white_balance, NULL, err));
    TRY(fs_photo_read_info(noflash.path, &noflash.exif, noflash.white_balance, NULL, err));
    if (fs_photo_kind_inside(flash.path) == PHOTO_NPY) memcpy(flash.white_balance, levels.gain, sizeof levels.gain);
    if (fs_photo_kind_inside(noflash.path) == PHOTO_NPY) memcpy(noflash.white_balance, levels.gain, sizeof levels.gain);
    common_white_balance(&flash, &noflash, levels.gain, log);
    turn_alike(&flash, &noflash, log);
    TRY(read_photo(&flash, &levels, settings->long_edge, err));
    TRY(read_photo(&noflash, &levels, settings->long_edge, err));
    if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "%s: stopped, nothing is written", out));
    warn_flash(&flash, &noflash, log);
    if (flash.width != noflash.width || flash.height != noflash.height)
        TRY(fs_error_input(err,
                           "%s: %d x %d pixels, but %s has %d x %d: both photos must come from one camera on a tripod",
                           noflash.path, noflash.width, noflash.height, flash.path, flash.width, flash.height));
    subtract(&flash, &noflash, exposure_ratio(&flash, &noflash, log), log);
    if (!settings->linear && fs_file_exists(tiff.text))
        fs_log_warn(log, "%s is not of this pair: take it away, then --linear makes one", tiff.text);
    TRY(write_difference(&flash.rgb, out, settings->linear ? tiff.text : NULL, log, err));
fail:
    fs_image_free(&flash.rgb);
    fs_image_free(&flash.clipped);
    fs_image_free(&noflash.rgb);
    fs_image_free(&noflash.clipped);
    return rc;
}

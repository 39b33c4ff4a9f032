// Describes a photo: its size and what its EXIF says about the shot.
#include "info/info.h"

#include <stdio.h>
#include <sys/stat.h>

#include "image/photo.h"

static void describe_exposure(const ExifInfo *exif, const Log *log)
{
    char exposure[64] = "exposure unknown";
    if (exif->exposure_s > 0 && exif->exposure_s < 0.3)
        snprintf(exposure, sizeof exposure, "1/%.0f s", 1 / exif->exposure_s);
    else if (exif->exposure_s > 0)
        snprintf(exposure, sizeof exposure, "%.3g s", exif->exposure_s);
    char iso[32] = "ISO unknown", aperture[32] = "aperture unknown";
    if (exif->iso > 0) snprintf(iso, sizeof iso, "ISO %.0f", exif->iso);
    if (exif->f_number > 0) snprintf(aperture, sizeof aperture, "f/%.3g", exif->f_number);
    fs_log_info(log, "  %s, %s, %s", exposure, iso, aperture);
}

static void describe_focal(const ExifInfo *exif, const Log *log)
{
    char focal[64] = "focal length unknown", pixels[64] = "";
    if (exif->focal_mm > 0) snprintf(focal, sizeof focal, "focal length %.4g mm", exif->focal_mm);
    double px = fs_exif_focal_px(exif, exif->exif_width, exif->exif_height);
    if (px > 0) snprintf(pixels, sizeof pixels, ", %.0f pixels", px);
    fs_log_info(log, "  %s%s", focal, pixels);
}

// A picture that no camera made: its size is all there is.
static int describe_picture(const char *path, const Log *log, FsError *err)
{
    Image image = {0};
    int kind = fs_photo_kind(path);
    int rc = kind > PHOTO_RAW ? fs_photo_read_stored(path, &image, err)
                              : fs_error_input(err, "%s: not a photo, a PLY, a COLMAP model or a project folder", path);
    if (rc == 0)
        fs_log_info(log, "%s: picture, %dx%d, %d channels, no EXIF", path, image.width, image.height, image.channels);
    fs_image_free(&image);
    return rc;
}

int fs_info_photo(const char *path, const Log *log, FsError *err)
{
    ExifInfo exif;
    struct stat st;
    MUST(fs_exif_read(path, &exif, err));
    if (stat(path, &st) != 0) return fs_error_input(err, "%s: cannot read", path);
    if (exif.flash < 0 && exif.exposure_s <= 0 && exif.exif_width <= 0 && exif.focal_mm <= 0 && !*exif.make)
        return describe_picture(path, log, err);
    char size[32], pixels[64] = "size unknown";
    fs_info_size((double)st.st_size, size, sizeof size);
    if (exif.exif_width > 0) snprintf(pixels, sizeof pixels, "%dx%d", exif.exif_width, exif.exif_height);
    fs_log_info(log, "%s: photo, %s, %s", path, pixels, size);
    if (*exif.make || *exif.model) fs_log_info(log, "  %s %s", exif.make, exif.model);
    int fired = fs_exif_flash_fired(&exif);
    if (fired < 0)
        fs_log_info(log, "  flash: the photo does not say (use --flash-glob or --flash-list)");
    else
        fs_log_info(log, "  flash: %s (EXIF Flash %d)", fired ? "fired" : "did not fire", exif.flash);
    describe_exposure(&exif, log);
    describe_focal(&exif, log);
    if (exif.orientation > 1) fs_log_info(log, "  orientation %d", exif.orientation);
    if (exif.neutral[1] > 0)
        fs_log_info(log, "  neutral in camera RGB: %.4g %.4g %.4g", exif.neutral[0], exif.neutral[1], exif.neutral[2]);
    return 0;
}

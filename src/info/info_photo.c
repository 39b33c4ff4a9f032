// Describes a photo, or each of a folder: its size and what it says about the shot.
#include "info/info.h"

#include <stdio.h>
#include <sys/stat.h>

#include "model/photos.h"

static void describe_focal(const ExifInfo *exif, const Log *log)
{
    char focal[64] = "focal length unknown", pixels[64] = "";
    if (exif->focal_mm > 0) snprintf(focal, sizeof focal, "focal length %.4g mm", exif->focal_mm);
    double px = fs_exif_focal_px(exif, exif->width, exif->height);
    if (px > 0) snprintf(pixels, sizeof pixels, ", %.0f pixels", px);
    fs_log_info(log, "  %s%s", focal, pixels);
}

static bool tells_nothing(const ExifInfo *exif)
{
    return exif->flash < 0 && exif->exposure_s <= 0 && exif->focal_mm <= 0 && !*exif->make && !*exif->model;
}

static int fired_of(const PhotoFile *photo)
{
    int fired = photo->folder_says >= 0 ? photo->folder_says : fs_exif_flash_fired(&photo->exif);
    return fired < 0 ? photo->name_says : fired;
}

static const char *flash_text(int fired)
{
    return fired < 0 ? "flash unknown" : fired ? "flash" : "no flash";
}

// A copy that was broken off has its header all the same; of RAW files and .npy the header tells the length.
static int check_picture(const char *path, FsError *err)
{
    Image image = {0};
    PhotoKind kind = fs_photo_kind_inside(path);
    int rc = kind == PHOTO_RAW || kind == PHOTO_NPY ? 0
             : kind == PHOTO_JPEG                   ? fs_jpeg_read_small(path, 1, &image, err)
                                                    : fs_photo_read_stored(path, &image, err);
    fs_image_free(&image);
    return rc;
}

int fs_info_photo(const char *path, const Log *log, FsError *err)
{
    ExifInfo exif;
    struct stat st;
    double white_balance[3];
    if (fs_photo_kind(path) < 0 && fs_photo_kind_inside(path) == PHOTO_RAW)
        return fs_error_input(err, "%s: not a photo, a PLY, a COLMAP model or a project folder", path);
    MUST(fs_photo_read_info(path, &exif, white_balance, NULL, err));
    if (stat(path, &st) != 0) return fs_error_input(err, "%s: cannot read", path);
    char size[32], pixels[64] = "size unknown", text[120];
    fs_info_size((double)st.st_size, size, sizeof size);
    if (exif.width > 0) snprintf(pixels, sizeof pixels, "%dx%d", exif.width, exif.height);
    if (tells_nothing(&exif)) {
        Image image = {0};
        PhotoKind kind = fs_photo_kind_inside(path);
        if (kind != PHOTO_RAW && kind != PHOTO_NPY) MUST(fs_photo_read_stored(path, &image, err));
        if (image.px) snprintf(pixels, sizeof pixels, "%dx%d, %d channels", image.width, image.height, image.channels);
        fs_image_free(&image);
        fs_log_info(log, "%s: picture, %s, %s, no EXIF", path, pixels, size);
        return 0;
    }
    fs_log_info(log, "%s: photo, %s, %s", path, pixels, size);
    if (*exif.make || *exif.model) fs_log_info(log, "  %s %s", exif.make, exif.model);
    int fired = fs_exif_flash_fired(&exif);
    if (fired < 0)
        fs_log_info(log, "  flash: the photo does not say (use --flash-glob or --flash-list)");
    else
        fs_log_info(log, "  flash: %s (EXIF Flash %d)", fired ? "fired" : "did not fire", exif.flash);
    fs_exif_exposure_text(&exif, text);
    fs_log_info(log, "  %s", text);
    describe_focal(&exif, log);
    if (exif.orientation > 1) fs_log_info(log, "  orientation %d", exif.orientation);
    if (exif.neutral[1] > 0)
        fs_log_info(log, "  neutral in camera RGB: %.4g %.4g %.4g", exif.neutral[0], exif.neutral[1], exif.neutral[2]);
    else if (white_balance[1] > 0)
        fs_log_info(log, "  white balance: %.4g %.4g %.4g", white_balance[0], white_balance[1], white_balance[2]);
    return check_picture(path, err);
}

int fs_info_photos(const char *folder, const Log *log, FsError *err)
{
    Photos photos = {0};
    int rc = 0, count[3] = {0};
    Threads *threads = fs_threads_new(0);
    if (!threads) TRY(fs_error_memory(err));
    TRY(fs_photos_scan(&photos, folder, log, err));
    fs_photos_read_headers(&photos, threads);
    for (int i = 0; i < photos.n; i++) {
        PhotoFile *photo = &photos.photo[i];
        char text[120];
        if (fs_log_cancelled(log)) TRY(fs_error_set(err, FS_ERR_CANCELLED, "%s: stopped", folder));
        fs_exif_exposure_text(&photo->exif, text);
        if (photo->failure.code)
            fs_log_warn(log, "%s", photo->failure.message);
        else
            fs_log_info(log, "%s: %dx%d, %s, %s", photo->file, photo->exif.width, photo->exif.height,
                        flash_text(fired_of(photo)), text);
        if (!photo->failure.code) count[1 + fired_of(photo)]++;
    }
    fs_log_info(log, "%s: %d photos: %d with flash, %d without, %d that do not say", folder, photos.n, count[2],
                count[1], count[0]);
fail:
    fs_photos_free(&photos);
    fs_threads_free(threads);
    return rc;
}

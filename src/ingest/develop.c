#include "ingest/develop.h"

#include <math.h>

#include "base/file.h"
#include "image/photo.h"
#include "model/camera.h"

// Upright working image and mask (1 = trusted).
static int shrink(PhotoFile *photo, Image *rgb, Image *clipped, int long_edge, Image *working, Image *mask,
                  FsError *err)
{
    Camera full = {.width = rgb->width, .height = rgb->height}, small = fs_camera_limited(&full, long_edge);
    MUST(fs_image_resize_area(rgb, small.width, small.height, working, err));
    MUST(fs_image_resize_area(clipped, small.width, small.height, mask, err));
    MUST(fs_image_orient(working, photo->exif.orientation, err));
    MUST(fs_image_orient(mask, photo->exif.orientation, err));
    bool turned = photo->exif.orientation > 4;
    photo->orig_width = turned ? rgb->height : rgb->width;
    photo->orig_height = turned ? rgb->width : rgb->height;
    photo->width = working->width;
    photo->height = working->height;
    double sum = 0, lost = 0;
    for (size_t i = 0; i < fs_image_values(working); i++) {
        working->px[i] *= (float)photo->gain;
        sum += working->px[i];
    }
    for (size_t i = 0; i < fs_image_pixels(mask); i++) {
        mask->px[i] = mask->px[i] < 1e-4f;
        lost += 1 - mask->px[i];
    }
    photo->mean = sum / (double)fs_image_values(working);
    photo->clipped = lost / (double)fs_image_pixels(mask);
    return 0;
}

// The photo as the pose finder wants it: larger than the working image where the photo is, 8 bits, dark parts raised.
static int write_features(const PhotoFile *photo, const Image *rgb, const char *dir, FsError *err)
{
    const float exponent = 0.35f; // between display values and linear light: flash and no-flash photos look alike
    int rc = 0;
    Image image = {0};
    Camera full = {.width = rgb->width, .height = rgb->height}, small = fs_camera_limited(&full, FS_FEATURES_LONG_EDGE);
    TRY(fs_image_resize_area(rgb, small.width, small.height, &image, err));
    TRY(fs_image_orient(&image, photo->exif.orientation, err));
    for (size_t i = 0; i < fs_image_values(&image); i++) {
        float v = image.px[i] * (float)photo->gain;
        image.px[i] = v > 0 ? powf(v, exponent) : 0;
    }
    TRY(fs_png_write(fs_file_at("%s/features/%s.png", dir, photo->name).text, &image, 8, err));
fail:
    fs_image_free(&image);
    return rc;
}

void fs_develop_photo(const Photos *photos, PhotoFile *photo, const char *dir, int long_edge)
{
    FsError *err = &photo->failure;
    Image rgb = {0}, clipped = {0}, working = {0}, mask = {0};
    FilePath path = fs_file_at("%s/%s", photos->folder, photo->file);
    int rc = fs_photo_read(path.text, photos->white_balance, &rgb, &clipped, &photo->encoded, err);
    if (rc == 0) rc = shrink(photo, &rgb, &clipped, long_edge, &working, &mask, err);
    if (rc == 0) rc = write_features(photo, &rgb, dir, err);
    fs_image_free(&rgb);
    fs_image_free(&clipped);
    if (rc == 0) rc = fs_tiff_write_float(fs_file_at("%s/%s.tif", dir, photo->name).text, &working, err);
    if (rc == 0) rc = fs_png_write(fs_file_at("%s/%s_mask.png", dir, photo->name).text, &mask, 8, err);
    fs_image_free(&working);
    fs_image_free(&mask);
}

// One photo to its working image and mask.
#include <math.h>

#include "base/file.h"
#include "image/tone.h"
#include "ingest/develop.h"
#include "ingest/photo_mask.h"
#include "model/dataset.h"

#define FINE 2            // finer than the working image is the one that a lens is undone on
#define FINE_EDGE 2000    // at most: 16 MB a photo
#define FINE_LEAST 1.2    // finer: less is not worth a file
#define FULL 0.9f         // of white: from there on a pixel that clipping has a part in is known from below only
#define BYTES_RESULT 24.0 // measured  a pixel of the pictures made of a photo
#define UNKNOWN_WIDTH 6000
#define UNKNOWN_HEIGHT 4000

// The mask, from the share of each pixel that is clipped or had its colour told from what is. Where it is darker than
// white all the same, as along a lamp's edge, it has a say: known from below only, the lamp would be taken for wider
// than it is. Returns the share of pixels that clipping has a part in.
static double trust(Image *clipped, const Image *rgb, double white)
{
    size_t n = fs_image_pixels(clipped), touched = 0;
    for (size_t i = 0; i < n; i++) {
        const float *p = rgb->px + 3 * i;
        bool whole = clipped->px[i] < 1e-4f;
        touched += !whole;
        bool dark = fmaxf(p[0], fmaxf(p[1], p[2])) < FULL * (float)white;
        clipped->px[i] = whole ? 1 : dark ? FS_MASK_PART : 0;
    }
    return (double)touched / (double)n;
}

// For `trust`: where the first of the colours clips in the working image. Of a photo whose response is to be learned no
// part of a clipped pixel counts: its mean is of values before the response, which would learn it.
static double white_of(const PhotoFile *photo, const PhotoSizes *sizes)
{
    return photo->encoded ? 0 : sizes->white * photo->gain;
}

// Upright working image and mask (dataset.h).
static int level(PhotoFile *photo, const PhotoSizes *sizes, Image *working, Image *mask, FsError *err)
{
    MUST(fs_image_orient(working, photo->exif.orientation, err));
    MUST(fs_image_orient(mask, photo->exif.orientation, err));
    bool turned = photo->exif.orientation > 4;
    photo->orig_width = turned ? sizes->height : sizes->width;
    photo->orig_height = turned ? sizes->width : sizes->height;
    photo->width = working->width;
    photo->height = working->height;
    double sum = 0, toned = 0;
    for (size_t i = 0; i < fs_image_values(working); i++) {
        working->px[i] *= (float)photo->gain;
        sum += working->px[i];
        toned += fs_tone_encode(working->px[i]);
    }
    photo->clipped = trust(mask, working, white_of(photo, sizes));
    photo->mean = sum / (double)fs_image_values(working);
    photo->brightness = toned / (double)fs_image_values(working);
    return 0;
}

// The photo as the pose finder wants it: larger than the working image where the photo is, 8 bits, dark parts raised.
static int write_features(const PhotoFile *photo, Image *image, const char *mask, const char *dir, FsError *err)
{
    Image used = {0};
    const float exponent = 0.35f; // between display values and linear light: flash and no-flash photos look alike
    MUST(fs_image_orient(image, photo->exif.orientation, err));
    for (size_t i = 0; i < fs_image_values(image); i++) {
        float v = image->px[i] * (float)photo->gain;
        image->px[i] = v > 0 ? powf(v, exponent) : 0;
    }
    if (mask) {
        MUST(fs_photo_mask_apply(mask, image, NULL, &used, err));
        int rc = fs_png_write(fs_file_at("%s/features_masks/%s.png.png", dir, photo->name).text, &used, 8, err);
        fs_image_free(&used);
        if (rc < 0) return rc;
    }
    return fs_png_write(fs_file_at("%s/features/%s.png", dir, photo->name).text, image, 8, err);
}

static int fine_edge(int long_edge)
{
    return FINE * long_edge < FINE_EDGE ? FINE * long_edge : FINE_EDGE;
}

// None that would hardly be finer.
static bool has_fine(int long_edge)
{
    return fine_edge(long_edge) > FINE_LEAST * long_edge;
}

double fs_develop_bytes(const PhotoFile *photo, int long_edge)
{
    const int edges[] = {long_edge, FS_DEVELOP_FEATURES_EDGE, fine_edge(long_edge)};
    double bytes = 0;
    for (int i = 0; i < (has_fine(long_edge) ? 3 : 2); i++) {
        bool known = photo->exif.width > 0 && photo->exif.height > 0;
        int width = known ? photo->exif.width : UNKNOWN_WIDTH, height = known ? photo->exif.height : UNKNOWN_HEIGHT;
        fs_image_limit(edges[i], &width, &height);
        bytes += BYTES_RESULT * width * height;
    }
    return bytes;
}

static int write_fine(const PhotoFile *photo, PhotoSize *fine, double white, const char *mask, const char *dir,
                      FsError *err)
{
    if (fine->rgb.width + fine->rgb.height < FINE_LEAST * (photo->width + photo->height)) return 0;
    MUST(fs_image_orient(&fine->rgb, photo->exif.orientation, err));
    MUST(fs_image_orient(&fine->clipped, photo->exif.orientation, err));
    for (size_t i = 0; i < fs_image_values(&fine->rgb); i++) fine->rgb.px[i] *= (float)photo->gain;
    trust(&fine->clipped, &fine->rgb, white);
    if (mask) MUST(fs_photo_mask_apply(mask, &fine->rgb, &fine->clipped, NULL, err));
    MUST(fs_tiff_write_half(fs_file_at("%s/fine/%s.tif", dir, photo->name).text, &fine->rgb, err));
    return fs_png_write(fs_file_at("%s/fine/%s_mask.png", dir, photo->name).text, &fine->clipped, 8, err);
}

void fs_develop_photo(const Photos *photos, PhotoFile *photo, const char *dir, int long_edge)
{
    FsError *err = &photo->failure;
    PhotoSizes sizes = {.n = has_fine(long_edge) ? 3 : 2};
    sizes.size[0].long_edge = long_edge;
    sizes.size[1].long_edge = FS_DEVELOP_FEATURES_EDGE;
    sizes.size[2].long_edge = fine_edge(long_edge);
    Image *working = &sizes.size[0].rgb, *mask = &sizes.size[0].clipped, *features = &sizes.size[1].rgb;
    FilePath path = fs_photos_path(photos, photo);
    FilePath mask_path;
    bool masked = fs_photos_mask(photos, photo, &mask_path);
    int rc;
    PhotoLight light;
    SensorLevels levels = fs_photos_developed(photos);
    TRY(fs_photo_read(path.text, &levels, &sizes, &light, err));
    photo->encoded = light >= PHOTO_ENCODED;
    photo->untold = light == PHOTO_UNTOLD;
    photo->unread = light == PHOTO_UNREAD;
    TRY(level(photo, &sizes, working, mask, err));
    TRY(fs_look_at(&photo->look, working, err));
    photo->look.clipped = photo->clipped;
    photo->look_gain = photo->gain;
    if (masked) TRY(fs_photo_mask_apply(mask_path.text, working, mask, NULL, err));
    TRY(write_features(photo, features, masked ? mask_path.text : NULL, dir, err));
    if (sizes.n == 3)
        TRY(write_fine(photo, &sizes.size[2], white_of(photo, &sizes), masked ? mask_path.text : NULL, dir, err));
    TRY(fs_tiff_write_float(fs_file_at("%s/%s.tif", dir, photo->name).text, working, err));
    TRY(fs_png_write(fs_file_at("%s/%s_mask.png", dir, photo->name).text, mask, 8, err));
fail:
    fs_sizes_free(&sizes);
}

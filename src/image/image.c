#include "image/image.h"

#include <stdlib.h>
#include <string.h>

int fs_image_new(Image *image, int width, int height, int channels, FsError *err)
{
    *image = (Image){0};
    if (width < 1 || height < 1 || width > FS_IMAGE_MAX_SIDE || height > FS_IMAGE_MAX_SIDE || channels < 1 ||
        channels > 4 || (int64_t)width * height > FS_IMAGE_MAX_PIXELS)
        return fs_error_input(err,
                              "an image of %d x %d pixels with %d channels: expected sides of 1..%d, at most %d "
                              "million pixels and 1..4 channels",
                              width, height, channels, FS_IMAGE_MAX_SIDE, FS_IMAGE_MAX_PIXELS / 1000000);
    float *px = calloc((size_t)width * (size_t)height * (size_t)channels, sizeof *px);
    if (!px) return fs_error_memory(err);
    *image = (Image){.width = width, .height = height, .channels = channels, .px = px};
    return 0;
}

void fs_image_free(Image *image)
{
    free(image->px);
    *image = (Image){0};
}

int fs_image_copy(Image *to, const Image *from, FsError *err)
{
    MUST(fs_image_new(to, from->width, from->height, from->channels, err));
    memcpy(to->px, from->px, fs_image_values(from) * sizeof *to->px);
    return 0;
}

// Orientation says where the stored rows and columns lie in the upright picture. Upright pixel (x, y) of a W x H
// stored image comes from stored (x, y) after an optional transpose and optional flips of the stored axes.
int fs_image_orient(Image *image, int exif_orientation, FsError *err)
{
    if (exif_orientation <= 1 || exif_orientation > 8) return 0;
    static const struct {
        bool transpose, flip_x, flip_y; // flips act on the stored axes
    } turn[9] = {
        [2] = {false, true, false}, [3] = {false, true, true}, [4] = {false, false, true}, [5] = {true, false, false},
        [6] = {true, false, true},  [7] = {true, true, true},  [8] = {true, true, false},
    };
    bool transpose = turn[exif_orientation].transpose;
    int w = image->width, h = image->height, c = image->channels;
    Image up;
    MUST(fs_image_new(&up, transpose ? h : w, transpose ? w : h, c, err));
    for (int y = 0; y < up.height; y++) {
        for (int x = 0; x < up.width; x++) {
            int sx = transpose ? y : x, sy = transpose ? x : y;
            if (turn[exif_orientation].flip_x) sx = w - 1 - sx;
            if (turn[exif_orientation].flip_y) sy = h - 1 - sy;
            memcpy(fs_image_at(&up, x, y), fs_image_at(image, sx, sy), (size_t)c * sizeof *up.px);
        }
    }
    fs_image_free(image);
    *image = up;
    return 0;
}

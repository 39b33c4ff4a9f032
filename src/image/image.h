// Float images, interleaved channels, row by row; and the readers and writers of each file format.
// Photos are linear light (1.0 = sensor white) unless a name says otherwise.
#pragma once

#include "base/error.h"

typedef struct Image {
    int width, height, channels;
    float *px; // (height, width, channels)
} Image;

static inline size_t fs_image_pixels(const Image *image)
{
    return (size_t)image->width * (size_t)image->height;
}

static inline size_t fs_image_values(const Image *image) // of all channels
{
    return fs_image_pixels(image) * (size_t)image->channels;
}

static inline float *fs_image_at(const Image *image, int x, int y) // the pixel's channels
{
    return image->px + ((size_t)y * (size_t)image->width + (size_t)x) * (size_t)image->channels;
}

#define FS_IMAGE_MAX_SIDE 65535
#define FS_IMAGE_MAX_PIXELS 400000000

int fs_image_new(Image *image, int width, int height, int channels, FsError *err); // zeroed
void fs_image_free(Image *image);                                                  // accepts {0}
int fs_image_copy(Image *to, const Image *from, FsError *err);

// Area average (exact box filter with fractional coverage) to a smaller size; in whatever space the values are.
int fs_image_resize_area(const Image *from, int width, int height, Image *to, FsError *err);
// The same while the rows come, from the top; `to` has its size and channels and is black. A row may be NULL: black.
typedef struct Resize {
    Image *to;
    int from_width, from_height, y, done; // rows taken and written
    double *sum;                          // (from_width, channels) of the rows under the next one
    bool touched;                         // it is not all 0
} Resize;
int fs_resize_begin(Resize *resize, int from_width, int from_height, Image *to, FsError *err);
void fs_resize_row(Resize *resize, const float *row);
void fs_resize_end(Resize *resize);
// Brings the longer side down to long_edge (0: stays), the shape kept.
void fs_image_limit(int long_edge, int *width, int *height);
// Quarter turns and flips as EXIF Orientation 1..8 asks, in place.
int fs_image_orient(Image *image, int exif_orientation, FsError *err);

// Readers give 1 channel (grey) or 3 (RGB); an alpha channel is dropped. Orientation is not applied.
// PNG: values 0..1 <-> 8 or 16 bits (rounded, clamped); the encoding (linear or not) is the caller's.
int fs_png_read(const char *path, Image *image, FsError *err);
int fs_png_write(const char *path, const Image *image, int bits, FsError *err);
// TIFF: 8, 16 bit integers as 0..1, float as is. Writes 32-bit float, deflate-compressed, or 16-bit float as it is
// (half the size, and fast).
int fs_tiff_read(const char *path, Image *image, FsError *err);
int fs_tiff_write_float(const char *path, const Image *image, FsError *err);
int fs_tiff_write_half(const char *path, const Image *image, FsError *err);
// JPEG: 8 bits as 0..1, encoded values (sRGB), not linearised.
int fs_jpeg_read(const char *path, Image *image, FsError *err);
// The same made smaller while it is decoded, by 2, 4 or 8, as long as the longer side stays at least `enough`.
int fs_jpeg_read_small(const char *path, int enough, Image *image, FsError *err);
// What goes along, each may be NULL: exif, a TIFF block ("II*" or "MM" first); icc, a colour profile.
typedef struct JpegExtras {
    const void *exif;
    size_t exif_size;
    const void *icc;
    size_t icc_size;
} JpegExtras;
// 1 or 3 channels of encoded values, clamped to 0..1. quality: 1..100; from 90 on colours keep their full resolution.
int fs_jpeg_write(const char *path, const Image *image, int quality, const JpegExtras *extras, FsError *err);
// What the file says of its values (profile.h); the caller's (fs_profile_tag_free).
typedef struct LightTag LightTag;
int fs_png_read_tag(const char *path, LightTag *tag, FsError *err);
int fs_tiff_read_tag(const char *path, LightTag *tag, FsError *err);
int fs_jpeg_read_tag(const char *path, LightTag *tag, FsError *err);

// TIFF through libtiff: integers and floats of 8 to 64 bits, grey or RGB, strips or tiles, either plane layout.
#include <stdlib.h>
#include <string.h>

#include "image/half.h"
#include "image/image.h"
#include "image/profile.h"
#include "image/tiff_file.h"

#define MAX_BLOCK ((tmsize_t)1 << 30) // bytes of one strip or tile

// How the samples lie in the file.
typedef struct Layout {
    uint32_t width, height;
    uint16_t samples, bits, format, planar, photometric;
    int channels; // of the image made of it
} Layout;

static int read_layout(TiffFile *t, Layout *l, FsError *err)
{
    uint16_t compression = 0;
    if (!TIFFGetField(t->tiff, TIFFTAG_IMAGEWIDTH, &l->width) ||
        !TIFFGetField(t->tiff, TIFFTAG_IMAGELENGTH, &l->height))
        return fs_tiff_file_bad(t, err);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_SAMPLESPERPIXEL, &l->samples);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_BITSPERSAMPLE, &l->bits);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_SAMPLEFORMAT, &l->format);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_PLANARCONFIG, &l->planar);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_COMPRESSION, &compression);
    if (!TIFFGetField(t->tiff, TIFFTAG_PHOTOMETRIC, &l->photometric))
        l->photometric = l->samples >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK;
    if (l->photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG) {
        TIFFSetField(t->tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
        l->photometric = PHOTOMETRIC_RGB;
    }
    bool grey = l->photometric == PHOTOMETRIC_MINISBLACK || l->photometric == PHOTOMETRIC_MINISWHITE;
    bool integer = l->format == SAMPLEFORMAT_UINT && (l->bits == 8 || l->bits == 16 || l->bits == 32);
    bool real = l->format == SAMPLEFORMAT_IEEEFP && (l->bits == 16 || l->bits == 32 || l->bits == 64);
    if ((!grey && l->photometric != PHOTOMETRIC_RGB) || l->samples < 1 || l->samples > 16 ||
        (!grey && l->samples < 3) || (!integer && !real))
        return fs_error_input(err,
                              "%s: a TIFF of photometric %d, %d samples of %d bits, format %d: expected grey or RGB of "
                              "8 or 16 bits or float",
                              t->path, l->photometric, l->samples, l->bits, l->format);
    l->channels = grey ? 1 : 3;
    return 0;
}

static float sample(const Layout *l, const unsigned char *block, size_t i)
{
    union {
        uint16_t u16;
        uint32_t u32;
        float f32;
        double f64;
    } v;
    size_t size = l->bits / 8u;
    if (size == 1) return (float)block[i] / 255.0f;
    memcpy(&v, block + i * size, size);
    if (l->format == SAMPLEFORMAT_UINT) return size == 2 ? (float)v.u16 / 65535.0f : (float)(v.u32 / 4294967295.0);
    return size == 2 ? half_to_float(v.u16) : size == 4 ? v.f32 : (float)v.f64;
}

// Copies a block of block_width x rows pixels that begins at (x, y) of the image; plane: its sample, or all of them.
typedef struct Block { // a tile, or a strip as wide as the picture
    const unsigned char *data;
    uint32_t x, y, width, rows;
    int plane; // -1: all channels
} Block;

static void put_block(const Layout *l, const Block *b, Image *image)
{
    int plane = b->plane;
    size_t in_step = l->planar == PLANARCONFIG_SEPARATE ? 1 : l->samples;
    uint32_t columns = b->width < l->width - b->x ? b->width : l->width - b->x;
    int first = plane < 0 ? 0 : plane, last = plane < 0 ? l->channels - 1 : plane;
    for (uint32_t j = 0; j < b->rows && b->y + j < l->height; j++) {
        for (uint32_t i = 0; i < columns; i++) {
            float *out = image->px + ((size_t)(b->y + j) * l->width + b->x + i) * (size_t)l->channels;
            size_t in = ((size_t)j * b->width + i) * in_step;
            for (int c = first; c <= last; c++) {
                float v = sample(l, b->data, in + (plane < 0 ? (size_t)c : 0));
                out[c] = l->photometric == PHOTOMETRIC_MINISWHITE ? 1.0f - v : v;
            }
        }
    }
}

static int read_blocks(TiffFile *t, const Layout *l, unsigned char *block, tmsize_t size, Image *image, FsError *err)
{
    bool tiled = TIFFIsTiled(t->tiff) != 0;
    uint32_t block_width = l->width, block_rows = 0;
    if (tiled) {
        TIFFGetField(t->tiff, TIFFTAG_TILEWIDTH, &block_width);
        TIFFGetField(t->tiff, TIFFTAG_TILELENGTH, &block_rows);
    } else {
        TIFFGetFieldDefaulted(t->tiff, TIFFTAG_ROWSPERSTRIP, &block_rows);
        if (block_rows > l->height) block_rows = l->height;
    }
    bool planes = l->planar == PLANARCONFIG_SEPARATE;
    size_t pixel = (size_t)(l->bits / 8) * (planes ? 1 : l->samples);
    if (!block_width || !block_rows || (tmsize_t)(pixel * block_width * (size_t)block_rows) > size)
        return fs_tiff_file_bad(t, err);
    for (int p = 0; p < (planes ? l->channels : 1); p++) {
        for (uint32_t y = 0; y < l->height; y += block_rows) {
            uint32_t rows = block_rows < l->height - y ? block_rows : l->height - y;
            for (uint32_t x = 0; x < l->width; x += block_width) {
                uint16_t plane = (uint16_t)p;
                tmsize_t want = tiled ? size : (tmsize_t)(pixel * block_width * rows);
                tmsize_t got = tiled
                                   ? TIFFReadEncodedTile(t->tiff, TIFFComputeTile(t->tiff, x, y, 0, plane), block, size)
                                   : TIFFReadEncodedStrip(t->tiff, TIFFComputeStrip(t->tiff, y, plane), block, want);
                if (got < want) return fs_tiff_file_bad(t, err);
                put_block(l, &(Block){block, x, y, block_width, rows, planes ? p : -1}, image);
                if (!tiled) break;
            }
        }
    }
    return 0;
}

int fs_tiff_read(const char *path, Image *image, FsError *err)
{
    *image = (Image){0};
    TiffFile t;
    unsigned char *block = NULL;
    int rc = fs_tiff_file_read(&t, path, err);
    if (rc < 0) return rc;
    Layout l = {0};
    FsError why;
    TRY(read_layout(&t, &l, err));
    if ((rc = fs_image_new(image, l.width > FS_IMAGE_MAX_SIDE ? -1 : (int)l.width,
                           l.height > FS_IMAGE_MAX_SIDE ? -1 : (int)l.height, l.channels, &why)) < 0) {
        fs_error_set(err, rc, "%s: %u x %u pixels: %s", path, l.width, l.height, why.message);
        goto fail;
    }
    tmsize_t size = TIFFIsTiled(t.tiff) ? TIFFTileSize(t.tiff) : TIFFStripSize(t.tiff);
    if (size <= 0 || size > MAX_BLOCK) TRY(fs_tiff_file_bad(&t, err));
    block = malloc((size_t)size);
    if (!block) TRY(fs_error_memory(err));
    TRY(read_blocks(&t, &l, block, size, image, err));
fail:
    free(block);
    fs_tiff_file_close(&t);
    if (rc < 0) fs_image_free(image);
    return rc;
}

int fs_tiff_read_tag(const char *path, LightTag *tag, FsError *err)
{
    *tag = (LightTag){0};
    TiffFile t;
    int rc = fs_tiff_file_read(&t, path, err);
    if (rc < 0) return rc;
    Layout l = {0};
    uint32_t size = 0;
    void *profile = NULL;
    TRY(read_layout(&t, &l, err));
    tag->deep = l.bits > 8;
    tag->linear = l.format == SAMPLEFORMAT_IEEEFP;
    if (TIFFGetField(t.tiff, TIFFTAG_ICCPROFILE, &size, &profile)) {
        tag->icc = malloc(size ? size : 1);
        if (!tag->icc) TRY(fs_error_memory(err));
        memcpy(tag->icc, profile, size);
        tag->icc_size = size;
    }
fail:
    fs_tiff_file_close(&t);
    return rc;
}

// bits: 32, compressed, or 16, as they are.
static bool write_all(TIFF *tiff, const Image *image, int bits, float *copy, uint32_t rows)
{
    size_t n = (size_t)image->width * (size_t)image->channels, bytes = (size_t)bits / 8;
    bool ok =
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)image->width) &&
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, (uint32_t)image->height) &&
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image->channels) &&
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits) &&
        TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP) &&
        TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, image->channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB) &&
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, bits == 16 ? COMPRESSION_NONE : COMPRESSION_ADOBE_DEFLATE) &&
        (bits == 16 || (TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_FLOATINGPOINT) &&
                        TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, 1))) &&
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows);
    for (uint32_t y = 0, strip = 0; ok && y < (uint32_t)image->height; y += rows, strip++) {
        uint32_t left = (uint32_t)image->height - y, count = rows < left ? rows : left;
        if (bits == 16)
            for (size_t i = 0; i < count * n; i++) ((uint16_t *)copy)[i] = half_from_float(image->px[y * n + i]);
        else
            memcpy(copy, image->px + y * n, count * n * bytes); // the predictor works in place
        ok = TIFFWriteEncodedStrip(tiff, strip, copy, (tmsize_t)(count * n * bytes)) >= 0;
    }
    return ok && TIFFFlush(tiff);
}

static int write_floats(const char *path, const Image *image, int bits, FsError *err)
{
    if (image->channels != 1 && image->channels != 3)
        return fs_error_set(err, FS_ERR_USAGE, "%s: a TIFF of %d channels: expected 1 or 3", path, image->channels);
    uint32_t rows = 32;
    TiffFile t;
    float *copy = malloc((size_t)rows * (size_t)image->width * (size_t)image->channels * sizeof *copy);
    int rc = copy ? fs_tiff_file_begin(&t, path, "", err) : fs_error_memory(err);
    if (rc == 0) rc = fs_tiff_file_commit(&t, write_all(t.tiff, image, bits, copy, rows), err);
    free(copy);
    return rc;
}

int fs_tiff_write_float(const char *path, const Image *image, FsError *err)
{
    return write_floats(path, image, 32, err);
}

int fs_tiff_write_half(const char *path, const Image *image, FsError *err)
{
    return write_floats(path, image, 16, err);
}

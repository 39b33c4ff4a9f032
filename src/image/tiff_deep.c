#include "image/tiff_deep.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

#include "base/file.h"

#define STRIP_BYTES (1 << 20)
#define DEFLATE_LEVEL 4
#define HEAD 8

enum {
    WIDTH = 256,
    HEIGHT,
    BITS,
    COMPRESSION,
    PHOTOMETRIC = 262,
    STRIPS = 273,
    ORIENTATION,
    SAMPLES = 277,
    ROWS_PER_STRIP,
    STRIP_SIZES,
    PLANAR = 284,
    PREDICTOR = 317,
    SUBFILE = 254,
    ICC = 34675,
    DNG_VERSION = 50706,
    DNG_BACKWARD,
    DNG_CAMERA,
    WHITE_LEVEL = 50717,
    COLOR_MATRIX = 50721,
    NEUTRAL = 50728,
    BASELINE_EXPOSURE = 50730,
    ILLUMINANT = 50778
};
enum { DEFLATE = 8, RGB = 2, LINEAR_RAW = 34892, D65 = 21, HORIZONTAL = 2 };

typedef struct Writer {
    AtomicFile file;
    const Image *image;
    bool packed;
    int rows; // of a strip
    uint32_t n, *place, *size;
    uint64_t at; // in the file
} Writer;

static int put_out(Writer *w, const void *data, size_t size, FsError *err)
{
    if (w->at + size > UINT32_MAX)
        return fs_error_set(err, FS_ERR_USAGE, "%s: larger than the 4 GiB that a TIFF holds", w->file.path);
    if (fs_file_put(&w->file, data, size) != (long)size) return fs_file_failed(&w->file, "no room", err);
    w->at += size;
    return 0;
}

// A row as 16 bits, little-endian; packed: each value less the one before it in its channel.
static void fill_row(const Writer *w, int y, unsigned char *to)
{
    size_t n = (size_t)w->image->width * 3;
    const float *px = w->image->px + (size_t)y * n;
    unsigned before[3] = {0};
    for (size_t i = 0; i < n; i++) {
        float v = px[i] > 0 ? px[i] < 1 ? px[i] : 1 : 0; // NaN becomes 0
        unsigned value = (unsigned)(v * 65535 + 0.5f), is = w->packed ? value - before[i % 3] : value;
        before[i % 3] = value;
        to[2 * i] = (unsigned char)is;
        to[2 * i + 1] = (unsigned char)(is >> 8);
    }
}

static int put_strips(Writer *w, FsError *err)
{
    size_t row = (size_t)w->image->width * 6, most = row * (size_t)w->rows;
    uLong bound = compressBound(most);
    unsigned char *plain = malloc(most), *packed = malloc(bound);
    int rc = plain && packed ? 0 : fs_error_memory(err);
    for (uint32_t s = 0; s < w->n && rc == 0; s++) {
        int first = (int)s * w->rows, last = first + w->rows < w->image->height ? first + w->rows : w->image->height;
        for (int y = first; y < last; y++) fill_row(w, y, plain + (size_t)(y - first) * row);
        uLong size = bound;
        size_t bytes = (size_t)(last - first) * row;
        if (w->packed && compress2(packed, &size, plain, bytes, DEFLATE_LEVEL) != Z_OK) TRY(fs_error_memory(err));
        w->place[s] = (uint32_t)w->at;
        w->size[s] = (uint32_t)(w->packed ? size : bytes);
        TRY(put_out(w, w->packed ? packed : plain, w->size[s], err));
        if (w->size[s] % 2) TRY(put_out(w, "", 1, err)); // values begin at even places
    }
fail:
    free(plain);
    free(packed);
    return rc;
}

static int put_list(Tags *tags, uint16_t id, uint16_t type, const uint32_t *value, uint32_t n, FsError *err)
{
    size_t each = fs_tags_value_size(type);
    unsigned char *bytes = malloc(each * n + 1);
    if (!bytes) return fs_error_memory(err);
    for (size_t i = 0; i < n; i++)
        for (size_t b = 0; b < each; b++) bytes[i * each + b] = (unsigned char)(value[i] >> (8 * b));
    int rc = fs_tags_put(tags, &(Tag){.id = id, .type = type, .count = n}, bytes, err);
    free(bytes);
    return rc;
}

static int put_layout(Tags *tags, const Writer *w, uint32_t photometric, FsError *err)
{
    const uint32_t bits[3] = {16, 16, 16};
    const struct {
        uint16_t id, type;
        uint32_t value;
    } numbers[] = {{SUBFILE, TAG_LONG, 0},
                   {WIDTH, TAG_LONG, (uint32_t)w->image->width},
                   {HEIGHT, TAG_LONG, (uint32_t)w->image->height},
                   {COMPRESSION, TAG_SHORT, w->packed ? DEFLATE : 1},
                   {PHOTOMETRIC, TAG_SHORT, photometric},
                   {ORIENTATION, TAG_SHORT, 1},
                   {SAMPLES, TAG_SHORT, 3},
                   {ROWS_PER_STRIP, TAG_LONG, (uint32_t)w->rows},
                   {PLANAR, TAG_SHORT, 1}};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        MUST(fs_tags_put_number(tags, TAGS_MAIN, numbers[i].id, numbers[i].type, numbers[i].value, err));
    if (w->packed) MUST(fs_tags_put_number(tags, TAGS_MAIN, PREDICTOR, TAG_SHORT, HORIZONTAL, err));
    MUST(put_list(tags, BITS, TAG_SHORT, bits, 3, err));
    MUST(put_list(tags, STRIPS, TAG_LONG, w->place, w->n, err));
    return put_list(tags, STRIP_SIZES, TAG_LONG, w->size, w->n, err);
}

// The strips first, then the directories, to which the head is made to point at last. tags: gets the layout's.
static int write_file(const char *path, const Image *image, Tags *tags, bool packed, FsError *err)
{
    Writer w = {.image = image, .packed = packed};
    unsigned char head[HEAD] = "II*", *block = NULL;
    size_t size, row = (size_t)image->width * 6;
    int rc, fewest = (image->height + 3999) / 4000; // so that the lists of strips stay short
    if (image->channels != 3)
        return fs_error_set(err, FS_ERR_USAGE, "%s: a picture of %d channels, expected 3", path, image->channels);
    w.rows = (int)(STRIP_BYTES / row) > fewest ? (int)(STRIP_BYTES / row) : fewest;
    w.n = (uint32_t)((image->height + w.rows - 1) / w.rows);
    MUST(fs_file_begin(&w.file, path, err));
    w.place = calloc(w.n, sizeof *w.place);
    w.size = calloc(w.n, sizeof *w.size);
    if (!w.place || !w.size) TRY(fs_error_memory(err));
    TRY(put_out(&w, head, HEAD, err));
    TRY(put_strips(&w, err));
    TRY(put_layout(tags, &w, packed ? RGB : LINEAR_RAW, err));
    uint32_t start = (uint32_t)w.at;
    TRY(fs_tags_build(tags, start, &block, &size, err));
    TRY(put_out(&w, block, size, err));
    for (int i = 0; i < 4; i++) head[4 + i] = (unsigned char)(start >> (8 * i));
    if (lseek(w.file.fd, 0, SEEK_SET) != 0 || fs_file_put(&w.file, head, HEAD) != HEAD)
        TRY(fs_file_failed(&w.file, "no room", err));
fail:
    free(block);
    free(w.place);
    free(w.size);
    if (rc == 0) return fs_file_commit(&w.file, err);
    fs_file_abort(&w.file);
    return rc;
}

int fs_tiff_deep_write(const char *path, const Image *image, const Tags *tags, const void *icc, size_t icc_size,
                       FsError *err)
{
    Tags all;
    MUST(fs_tags_copy(&all, tags, err));
    const Tag profile = {.id = ICC, .type = TAG_UNDEFINED, .count = (uint32_t)icc_size};
    int rc = icc ? fs_tags_put(&all, &profile, icc, err) : 0;
    if (rc == 0) rc = write_file(path, image, &all, true, err);
    fs_tags_free(&all);
    return rc;
}

int fs_tiff_deep_write_dng(const char *path, const Image *image, const Tags *tags, const DngCamera *camera,
                           FsError *err)
{
    Tags all;
    const uint32_t white[3] = {65535, 65535, 65535};
    const Tag version = {.id = DNG_VERSION, .type = TAG_BYTE, .count = 4},
              backward = {.id = DNG_BACKWARD, .type = TAG_BYTE, .count = 4};
    int rc;
    MUST(fs_tags_copy(&all, tags, err));
    TRY(fs_tags_put(&all, &version, "\1\4\0\0", err));
    TRY(fs_tags_put(&all, &backward, "\1\1\0\0", err));
    TRY(fs_tags_put_text(&all, TAGS_MAIN, DNG_CAMERA, camera->name, err));
    TRY(put_list(&all, WHITE_LEVEL, TAG_LONG, white, 3, err));
    TRY(fs_tags_put_fractions(&all, COLOR_MATRIX, TAG_SRATIONAL, camera->camera_from_xyz, 9, err));
    TRY(fs_tags_put_fractions(&all, NEUTRAL, TAG_RATIONAL, camera->neutral, 3, err));
    TRY(fs_tags_put_fractions(&all, BASELINE_EXPOSURE, TAG_SRATIONAL, &camera->baseline_exposure, 1, err));
    TRY(fs_tags_put_number(&all, TAGS_MAIN, ILLUMINANT, TAG_SHORT, D65, err));
    TRY(write_file(path, image, &all, false, err));
fail:
    fs_tags_free(&all);
    return rc;
}
